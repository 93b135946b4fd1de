"""Convex pieces of meshes as files, so that the same mesh is taken apart once: for all uploads, keys and processes.

A file is written whole or not at all, and never changes; who finds none, or a damaged one, makes the pieces again.
"""

from __future__ import annotations

import json
import os
import uuid
from contextlib import suppress
from pathlib import Path

import numpy as np

from duocell.models.base.errors import InvalidInput
from duocell.models.geometry.decomposition import Decomposition
from duocell.models.geometry.shapes import ConvexHull

MOST_BYTES = 100_000_000
"""Of all files together; a mesh takes some ten thousand. Beyond it those go that were not asked for longest."""
KEPT_SHARE = 0.75
"""Of these bytes that stay when some have to go, so that not every mesh looks through the folder for the oldest."""


class PieceFiles:
    """Decompositions in a folder (a `duocell.models.geometry.piece_cache.PieceCache`)."""

    def __init__(self, folder: Path, most: int = MOST_BYTES) -> None:
        self._folder = folder
        self._most = most

    def find(self, key: str) -> Decomposition | None:
        """See `PieceCache`."""
        path = self._folder / f"{key}.json"
        try:
            document = json.loads(path.read_bytes())
            pieces = tuple(ConvexHull(np.array(piece, dtype=np.float64)) for piece in document["pieces"])
            extent = np.array(document["extent"], dtype=np.float64).reshape(3)
            found = Decomposition(pieces, float(document["dent"]), int(document["left_out"]), extent)
        except (OSError, ValueError, KeyError, TypeError, InvalidInput):
            return None
        with suppress(OSError):
            os.utime(path)  # asked for just now
        return found

    def keep(self, key: str, made: Decomposition) -> None:
        """See `PieceCache`; where nothing can be written nothing is kept."""
        document = {
            "pieces": [piece.points.tolist() for piece in made.pieces],
            "dent": made.dent,
            "left_out": made.left_out,
            "extent": made.extent.tolist(),
        }
        fresh = self._folder / f".{uuid.uuid4().hex}"
        with suppress(OSError):
            self._folder.mkdir(parents=True, exist_ok=True)
            try:
                fresh.write_text(json.dumps(document, separators=(",", ":"), allow_nan=False), encoding="ascii")
                fresh.replace(self._folder / f"{key}.json")
            finally:
                fresh.unlink(missing_ok=True)
            self._make_room()

    def _make_room(self) -> None:
        """Remove the files that were not asked for longest; other processes may do the same meanwhile."""
        files = []
        for path in self._folder.iterdir():  # half-written ones of processes that were killed count, and go, as well
            with suppress(OSError):
                stat = path.stat()
                files.append((stat.st_mtime, stat.st_size, path))
        total = sum(size for _, size, _ in files)
        if total <= self._most:
            return
        for _, size, path in sorted(files):
            if total <= KEPT_SHARE * self._most:
                return
            path.unlink(missing_ok=True)
            total -= size
