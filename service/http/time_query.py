"""Moments in query parameters (RFC 3339)."""

from __future__ import annotations

from datetime import UTC, datetime

from duocell.service.common.issues import Issue
from duocell.service.common.problems import Problem


def parse_timestamp(name: str, text: str | None) -> datetime | None:
    """The moment that a parameter names, in UTC.

    Raises:
        Problem: it names none.
    """
    if text is None:
        return None
    try:
        moment = datetime.fromisoformat(text.upper())
        if moment.tzinfo is None:
            raise ValueError("no time zone")
    except ValueError as error:
        detail = f"{name} is {text[:40]!r}; a moment with its time zone is needed, such as 2026-11-22T09:30:00Z."
        raise Problem("invalid-request", detail, errors=[Issue("", detail)]) from error
    try:
        return moment.astimezone(UTC)
    except OverflowError:  # within a day of the beginning or the end of the calendar
        return (datetime.min if moment.year == 1 else datetime.max).replace(tzinfo=UTC)
