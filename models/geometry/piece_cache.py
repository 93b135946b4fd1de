"""What meshes were taken apart into before, by everything that the result depends on."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Sequence
from typing import Protocol

from duocell.models.geometry.decomposition import Decomposition

ALGORITHM = 1
"""Raised when `duocell.models.geometry.decomposition`, or what reads meshes, comes to other results."""


class PieceCache(Protocol):
    """Decompositions by key; one that is not found again is only made again."""

    def find(self, key: str) -> Decomposition | None:
        """What was kept, if it is still there."""
        ...

    def keep(self, key: str, made: Decomposition) -> None:
        """Keep something, if there is room."""
        ...


def key_of(data: bytes, kind: str, factors: Sequence[float], most: int) -> str:
    """Key (64 hexadecimal digits) of a decomposition.

    Args:
        data: contents of the mesh file. kind: its format.
        factors: that the vertices are multiplied with. most: pieces that are allowed.
    """
    digest = hashlib.sha256(data)
    digest.update(repr((ALGORITHM, kind.lower(), [float(factor) for factor in factors], most)).encode())
    return digest.hexdigest()


class PiecesInMemory:
    """The last ones that this process has made."""

    def __init__(self, most: int = 256) -> None:
        self._most = most
        self._kept: OrderedDict[str, Decomposition] = OrderedDict()

    def find(self, key: str) -> Decomposition | None:
        """See `PieceCache`."""
        found = self._kept.get(key)
        if found is not None:
            self._kept.move_to_end(key)
        return found

    def keep(self, key: str, made: Decomposition) -> None:
        """See `PieceCache`."""
        self._kept[key] = made
        while len(self._kept) > self._most:
            self._kept.popitem(last=False)
