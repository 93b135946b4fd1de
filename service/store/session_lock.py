"""Signs of life beside the lease: what the operating system or the database takes away when a server dies."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Protocol

from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import SQLAlchemyError

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job_store import OTHER, LeaseLost
from duocell.service.store.sqlite_file import identity

SERVERS = 0x_64_75_6F_63_65_6C_6C  # "duocell": any number that other programs do not use
"""Advisory lock that all servers of a PostgreSQL database share, and a migration and versions before 0004 do not."""


class SessionLock(Protocol):
    """Held by a server as long as it lives."""

    number: int
    """Of this lock, for others to ask whether it is free."""

    def hold(self) -> None:
        """Take it, or see that it is still there.

        Raises:
            StoreUnavailable: it cannot be had.
        """

    def verify(self) -> None:
        """See that it still keeps others out, as far as that can be seen without asking the database.

        Raises:
            StoreUnavailable: it does not.
        """

    def is_free(self, connection: Connection, number: int) -> bool:
        """Whether nobody holds the lock of a number, so that its holder is gone."""

    def release(self) -> None:
        """Give it back."""


class FileLock:
    """A lock on a file beside a SQLite database; the kernel releases it when the process ends, however it ends."""

    number = 0

    def __init__(self, database: Path) -> None:
        self._path = Path(f"{database}.lock")
        self._file: int | None = None

    def hold(self) -> None:
        """See `SessionLock`. A lock on a file that was deleted keeps nobody out: it is taken anew."""
        if self._file is not None and not self._named():
            self.release()
        if self._file is None:
            self._file = self._locked()

    def _locked(self) -> int:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise StoreUnavailable(f"{self._path.parent} cannot be used: {error.strerror}.") from error
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(file)
            raise LeaseLost(OTHER) from error
        return file

    def verify(self) -> None:
        """See `SessionLock`."""
        if self._file is not None and not self._named():
            raise StoreUnavailable(f"{self._path} was deleted while the server had it open.")

    def _named(self) -> bool:
        """Whether the name still leads to the file that is locked."""
        if self._file is None:
            return False
        held = os.fstat(self._file)
        return identity(self._path) == (held.st_dev, held.st_ino)

    def is_free(self, connection: Connection, number: int) -> bool:
        """See `SessionLock`; who holds the file lock knows that nobody else does."""
        return True

    def release(self) -> None:
        """See `SessionLock`."""
        if self._file is not None:
            os.close(self._file)
            self._file = None


class AdvisoryLock:
    """A session lock in PostgreSQL, each server's own; it is released when the connection ends."""

    def __init__(self, engine: Engine, number: int) -> None:
        self._engine = engine
        self.number = number
        self._connection: Connection | None = None

    def hold(self) -> None:
        """See `SessionLock`."""
        if self._connection is not None:
            try:
                self._connection.execute(text("SELECT 1"))
                return
            except SQLAlchemyError:  # the connection is gone, and the lock with it
                self.release()
        connection = self._engine.connect().execution_options(isolation_level="AUTOCOMMIT")
        try:
            shared = _asked(connection, "pg_try_advisory_lock_shared", SERVERS)
            got = shared and _asked(connection, "pg_try_advisory_lock", self.number)
        except SQLAlchemyError:
            connection.invalidate()
            connection.close()
            raise
        if not got:
            connection.invalidate()
            connection.close()
            raise LeaseLost(OTHER)
        self._connection = connection

    def verify(self) -> None:
        """See `SessionLock`; the lease alone decides."""

    def is_free(self, connection: Connection, number: int) -> bool:
        """See `SessionLock`."""
        return _asked(connection, "pg_try_advisory_xact_lock", number)

    def release(self) -> None:
        """See `SessionLock`."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.invalidate()  # never back into the pool: the lock lives as long as the session
            connection.close()


def _asked(connection: Connection, function: str, number: int) -> bool:
    return bool(connection.execute(text(f"SELECT {function}(:number)"), {"number": number}).scalar())
