"""Cursors of lists: the number of the last item shown, so that new items never shift a page."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable
from typing import Annotated
from urllib.parse import urlencode

from fastapi import Depends, Request

from duocell.service.common.issues import Issue
from duocell.service.common.problems import Problem

LARGEST = 2**63 - 1
"""Number that a database can hold."""


def encode(number: int) -> str:
    """The cursor behind an item."""
    return base64.urlsafe_b64encode(f"{number:x}.".encode()).decode().rstrip("=")


def decode(cursor: str) -> int:
    """The number in a cursor.

    Raises:
        Problem: this service did not make it.
    """
    try:
        text = base64.urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)).decode("ascii")
        number = int(text.removesuffix("."), 16)
        if not 0 <= number <= LARGEST or encode(number) != cursor:
            raise ValueError("no number of a job")
    except (ValueError, binascii.Error) as error:
        detail = "The cursor is none of this service's. Use `next_cursor` of the page before, or leave it out."
        raise Problem("invalid-request", detail, errors=[Issue("", detail)]) from error
    return number


async def _link(request: Request) -> Callable[[str], str]:
    """Makes the header Link that leads to the page behind a cursor: the address asked for, with that cursor."""

    def link(cursor: str) -> str:
        query = [(key, value) for key, value in request.query_params.multi_items() if key != "cursor"]
        return f'<{request.url.path}?{urlencode([*query, ("cursor", cursor)])}>; rel="next"'

    return link


LinkToNext = Annotated[Callable[[str], str], Depends(_link)]
