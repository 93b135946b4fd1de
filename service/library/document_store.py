"""A folder of documents that never change: each is put there and taken away in one step, whatever happens meanwhile.

A document that was taken away is kept as a tombstone for a while, for those who were promised it before.
"""

from __future__ import annotations

import json
import os
import re
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
"""What a document may be called: a file name everywhere, and never one of ours (which start with a dot)."""

_SUFFIX = ".json"
_TOMBSTONES = ".deleted"


class DocumentStore:
    """Documents by name and version in a folder, which is made with the first of them."""

    def __init__(self, folder: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._folder = folder
        self._tombstones = folder / _TOMBSTONES
        self._clock = clock
        self._seen: dict[tuple[Path, int], float] = {}  # when a file was first seen here, by the clock of this process

    def names(self) -> list[str]:
        """Names of all documents, sorted."""
        found = (path.name.removesuffix(_SUFFIX) for path in self._folder.glob(f"[!.]*{_SUFFIX}"))
        return sorted(name for name in found if NAME.fullmatch(name))

    def count(self) -> int:
        """Number of documents, those kept as tombstones included."""
        return len(self.names()) + sum(1 for _ in self._tombstones.glob(f"*{_SUFFIX}"))

    def path(self, name: str) -> Path | None:
        """File of a document, or None if there is none."""
        return self._present(self._folder / (name + _SUFFIX)) if NAME.fullmatch(name) else None

    def tombstone(self, name: str, version: str) -> Path | None:
        """File of a document that was taken away and is kept for a while, or None."""
        good = NAME.fullmatch(name) and NAME.fullmatch(version)
        return self._present(self._tombstones / f"{name}@{version}{_SUFFIX}") if good else None

    def put(self, name: str, document: dict[str, Any]) -> bool:
        """Add a document; False if the name is taken.

        Raises:
            OSError: the folder cannot be written; nothing is left in it.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        fresh = self._folder / f".{uuid.uuid4().hex}"
        try:
            with fresh.open("w", encoding="utf-8") as file:
                json.dump(document, file, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
                file.flush()
                os.fsync(file.fileno())
            os.link(fresh, self._folder / (name + _SUFFIX))  # unlike a rename it never replaces anything
        except FileExistsError:
            return False
        finally:
            fresh.unlink(missing_ok=True)
        _sync(self._folder)
        return True

    def take(self, name: str, version: str) -> bool:
        """Take a document away and keep it as a tombstone; False if there is none.

        Raises:
            OSError: the folder cannot be written.
        """
        path = self.path(name)
        if path is None:
            return False
        self._tombstones.mkdir(exist_ok=True)
        kept = self._tombstones / f"{name}@{version}{_SUFFIX}"
        try:
            path.rename(kept)
        except FileNotFoundError:
            return False  # somebody else was faster
        self._seen[kept, kept.stat().st_ino] = self._clock()  # from now on it ages
        _sync(self._folder)
        return True

    def forget(self, age: float) -> None:
        """Remove what was taken away more than ``age`` s ago, and what a crash left half-written.

        Age counts from when this process first saw a file, at the earliest from its start: the wall clock may jump.

        Raises:
            OSError: the folder cannot be written.
        """
        old = [(path, age) for path in self._tombstones.glob(f"*{_SUFFIX}")]
        old += [(path, _ABANDONED) for path in self._folder.glob(".*") if path.is_file()]
        present = {(path, path.stat().st_ino): limit for path, limit in old}
        now = self._clock()
        self._seen = {file: self._seen.get(file, now) for file in present}
        for file, limit in present.items():
            if now - self._seen[file] >= limit:
                file[0].unlink(missing_ok=True)

    def _present(self, path: Path) -> Path | None:
        return path if path.is_file() else None


_ABANDONED = 3600.0
"""s; nobody writes a document for an hour."""


def _sync(folder: Path) -> None:
    """See to it that the entries of a folder survive a power cut."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
