"""Cursors of lists: the key of the last item shown, so that new items never shift a page."""

from __future__ import annotations

import base64
import binascii
from datetime import datetime

from service.issues import Issue
from service.jobs.job import is_job_id
from service.problems import Problem


def encode(key: tuple[datetime, str]) -> str:
    """The cursor behind an item."""
    moment, job_id = key
    return base64.urlsafe_b64encode(f"{moment.isoformat()} {job_id}".encode()).decode().rstrip("=")


def decode(cursor: str) -> tuple[datetime, str]:
    """The key in a cursor.

    Raises:
        Problem: this service did not make it.
    """
    try:
        text = base64.urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)).decode("ascii")
        moment, job_id = text.split(" ")
        if not is_job_id(job_id):
            raise ValueError("no identifier of a job")
        key = datetime.fromisoformat(moment), job_id
        if key[0].tzinfo is None:
            raise ValueError("no time zone")
    except (ValueError, binascii.Error) as error:
        detail = "The cursor is none of this service's. Use `next_cursor` of the page before, or leave it out."
        raise Problem("invalid-request", detail, errors=[Issue("", detail)]) from error
    return key
