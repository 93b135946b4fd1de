"""The files of a SQLite database: whether they are still the ones that were opened, and whether they are whole."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from duocell.service.common.job_errors import StoreUnavailable

DAMAGE = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB}
"""Primary error codes of SQLite that mean it."""


class SqliteFile:
    """A database file with the two files beside it that belong to it as long as it is open.

    They must stay the ones that were opened: what is written to a file without a name is gone with the process. They
    are looked at by name only, since closing any handle of them would drop the locks that SQLite has on them.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._keeper: sqlite3.Connection | None = None
        self._known: dict[Path, tuple[int, int] | None] = {}

    def keep_open(self) -> None:
        """Have a connection of its own for good, so that the files stay, and remember which ones they are."""
        if self._keeper is None:
            self._keeper = sqlite3.connect(self.path, check_same_thread=False)
            self._keeper.execute("SELECT count(*) FROM alembic_version").fetchall()
            names = (self.path, Path(f"{self.path}-wal"), Path(f"{self.path}-shm"))
            self._known = {name: found for name in names if (found := identity(name)) is not None}

    def verify(self) -> None:
        """See that the names still lead to the files that are open.

        Raises:
            StoreUnavailable: one does not.
        """
        for path, known in self._known.items():
            if identity(path) != known:
                raise StoreUnavailable(
                    f"{path} was deleted or replaced while the server had it open, so that nothing can be kept. Put "
                    "the same file back, or restart the server to go on with what is there."
                )

    def examine(self) -> None:
        """Read the whole file, past all caches.

        Raises:
            StoreUnavailable: it is damaged.
        """
        with closing(sqlite3.connect(self.path)) as connection:
            try:
                found = connection.execute("PRAGMA integrity_check(1)").fetchone()[0]
            except sqlite3.DatabaseError as error:
                found = str(error)
                if not is_damage(error):
                    raise StoreUnavailable(f"The store of the jobs cannot be read: {error}.") from error
        if found != "ok":
            raise StoreUnavailable(f"{self.path} is damaged: {found}. Put a copy back, or take the file away; restart.")

    def close(self) -> None:
        """Let go of it."""
        if self._keeper is not None:
            self._keeper.close()
            self._keeper = None
        self._known = {}


def identity(path: Path) -> tuple[int, int] | None:
    """Device and number of a file, None if there is none of that name."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def is_damage(error: object) -> bool:
    """Whether an error of SQLite means that the file is damaged."""
    code = getattr(error, "sqlite_errorcode", None)
    return code is not None and code & 0xFF in DAMAGE
