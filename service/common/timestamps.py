"""Timestamps in documents (RFC 3339)."""

from __future__ import annotations

from datetime import datetime


def timestamp(moment: datetime | None) -> str | None:
    """RFC 3339, UTC."""
    return None if moment is None else moment.isoformat(timespec="microseconds").replace("+00:00", "Z")
