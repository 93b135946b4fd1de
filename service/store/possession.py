"""One process at a time: who has a store open, and whether it still has."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Protocol

from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import SQLAlchemyError

from service.store.job_store import StoreUnavailable

LOCK_NUMBER = 0x_64_75_6F_63_65_6C_6C  # "duocell": any number that other programs do not use
"""Of the advisory lock in PostgreSQL; it counts per database."""
OTHER = (
    "Another server has this store open. Stop it, or give this one its own DUOCELL_DATA_DIR or DUOCELL_DATABASE_URL."
)


class Possession(Protocol):
    """The right to use a store."""

    def take(self) -> None:
        """Get it, or see that it is still there.

        Raises:
            StoreUnavailable: somebody else has it, or it cannot be had.
        """

    def release(self) -> None:
        """Give it back."""


class FileLock:
    """A lock on a file beside the database; the kernel releases it when the process ends, however it ends."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None

    def take(self) -> None:
        """See `Possession`."""
        if self._file is not None:
            return
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise StoreUnavailable(f"{self._path.parent} cannot be used: {error.strerror}.") from error
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(file)
            raise StoreUnavailable(OTHER) from error
        self._file = file

    def release(self) -> None:
        """See `Possession`."""
        if self._file is not None:
            os.close(self._file)
            self._file = None


class AdvisoryLock:
    """A session lock in PostgreSQL; the server releases it when the connection ends."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._connection: Connection | None = None

    def take(self) -> None:
        """See `Possession`."""
        if self._connection is not None:
            try:
                self._connection.execute(text("SELECT 1"))
                return
            except SQLAlchemyError:  # the connection is gone, and the lock with it
                self.release()
        connection = self._engine.connect().execution_options(isolation_level="AUTOCOMMIT")
        try:
            got = connection.execute(text("SELECT pg_try_advisory_lock(:number)"), {"number": LOCK_NUMBER}).scalar()
        except SQLAlchemyError:
            connection.invalidate()
            connection.close()
            raise
        if not got:
            connection.close()
            raise StoreUnavailable(OTHER)
        self._connection = connection

    def release(self) -> None:
        """See `Possession`."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.invalidate()  # never back into the pool: the lock lives as long as the session
            connection.close()
