"""Connections to the two kinds of database, set up so that what is acknowledged is on the disk."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.exc import NoSuchModuleError

from duocell.service.common.job_errors import StoreUnavailable

BUSY_TIMEOUT = 2_000
"""ms that a connection to SQLite waits for another process to finish its transaction."""
LARGEST_JOURNAL = 64_000_000
"""bytes; SQLite cuts its write-ahead log back to this after a checkpoint."""
CONNECT_TIMEOUT = 4
"""s to reach PostgreSQL."""
IMMEDIATE = "duocell_immediate"
"""Execution option of connections that are going to write."""


def database_file(url: URL) -> Path:
    """The file of a SQLite database."""
    return Path(str(url.database))


def make_engine(url: str, *, patient: bool = False) -> Engine:
    """Connections to a database.

    Args:
        url: from `sqlite_url` or `checked_url`.
        patient: whether a statement may take as long as it likes, as in a migration; otherwise some seconds.

    Raises:
        StoreUnavailable: its driver is missing.
    """
    try:
        if url.startswith("sqlite"):
            return _sqlite(url)
        engine = create_engine(url, pool_pre_ping=True, connect_args={"connect_timeout": CONNECT_TIMEOUT})
        if not patient:
            from duocell.service.store.bounded_connection import bound

            bound(engine)
        return engine
    except (NoSuchModuleError, ImportError) as error:
        raise StoreUnavailable(f"The driver of the database is missing: {error}.") from error


def _sqlite(url: str) -> Engine:
    engine = create_engine(url, connect_args={"timeout": BUSY_TIMEOUT / 1000.0})

    @event.listens_for(engine, "connect")
    def configure(connection: sqlite3.Connection, _: Any) -> None:
        connection.isolation_level = None  # transactions are begun below, not by the driver
        for pragma in (
            f"busy_timeout = {BUSY_TIMEOUT}",
            "journal_mode = WAL",  # readers never wait for the writer
            "synchronous = FULL",  # a commit is on the disk when it returns, also if the power fails
            "foreign_keys = ON",
            f"journal_size_limit = {LARGEST_JOURNAL}",
        ):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # A transaction that reads first and then wants to write fails at once if another has written in between,
        # however long it was told to wait: those that write say so from the beginning.
        immediate = connection.get_execution_options().get(IMMEDIATE, False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if immediate else "BEGIN")

    return engine
