"""URLs of databases that can be used."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import make_url
from sqlalchemy.exc import ArgumentError

FILE = "duocell.sqlite3"


def sqlite_url(folder: Path) -> str:
    """The URL of the database in a data directory."""
    return f"sqlite:///{folder.absolute() / FILE}"


def checked_url(url: str) -> str:
    """A URL of a database that can be used.

    Raises:
        ValueError: with what is wrong, without the password in it.
    """
    try:
        parsed = make_url(url)
    except ArgumentError:
        raise ValueError("is no URL of a database; postgresql://user:password@host:5432/name is one") from None
    if parsed.drivername in ("postgresql", "postgres"):
        parsed = parsed.set(drivername="postgresql+psycopg")
    if parsed.drivername not in ("sqlite", "postgresql+psycopg"):
        raise ValueError(f"names the database {parsed.drivername!r}; sqlite and postgresql are known")
    return parsed.render_as_string(hide_password=False)
