"""Meshes that users brought: what is known about them, and how it is kept as a JSON document."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.geometry.shapes import ConvexHull

FORMAT = 1
"""Of the documents; raised when their meaning changes."""


@dataclass(frozen=True, eq=False)
class UserMesh:
    """A solid in the units of its file.

    Attributes:
        id: digest of the file.
        name: label.
        kind: "stl", "obj" or "dae".
        size: bytes of the file.
        triangles: number of them.
        bounds: (2, 3) least and greatest coordinates.
        pieces: corners (k, 3) of the convex pieces that stand for it.
        created_at: RFC 3339.
        depth: deepest dent that the pieces fill; None where it was not kept.
        left_out: flat parts, without volume, that the pieces do not contain.
    """

    id: str
    name: str
    kind: str
    size: int
    triangles: int
    bounds: Floats
    pieces: tuple[Floats, ...]
    created_at: str
    depth: float | None = None
    left_out: int = 0

    def scaled(self, scale: float) -> tuple[ConvexHull, ...]:
        """The pieces in metres.

        Raises:
            InvalidInput: the scale is not positive, or makes them too large or too thin; pointer ``/scale``.
        """
        return _scaled(self, scale)


@lru_cache(maxsize=256)
def _scaled(mesh: UserMesh, scale: float) -> tuple[ConvexHull, ...]:
    if not np.isfinite(scale) or scale <= 0.0:
        raise InvalidInput(f"scale is {scale:g}; it must be positive, 0.001 for a file in millimetres.", "/scale")
    try:
        return tuple(ConvexHull(piece * scale) for piece in mesh.pieces)
    except InvalidInput as error:
        extent = ", ".join(f"{side:.4g}" for side in np.ptp(mesh.bounds, axis=0) * scale)
        raise InvalidInput(
            f"with the scale {scale:g} the mesh measures {extent} m and cannot be used: {error.detail} "
            "Is the scale right (0.001 for millimetres)?",
            "/scale",
        ) from error


def mesh_document(mesh: UserMesh) -> dict[str, Any]:
    """A mesh as plain JSON; numbers keep every digit."""
    return {
        "format": FORMAT,
        "id": mesh.id,
        "name": mesh.name,
        "kind": mesh.kind,
        "size": mesh.size,
        "triangles": mesh.triangles,
        "bounds": mesh.bounds.tolist(),
        "pieces": [piece.tolist() for piece in mesh.pieces],
        "created_at": mesh.created_at,
        "depth": mesh.depth,
        "left_out": mesh.left_out,
    }


def mesh_from_document(document: dict[str, Any]) -> UserMesh:
    """A mesh from its document.

    Raises:
        ValueError, KeyError, TypeError: it is no such document.
    """
    if document["format"] != FORMAT:
        raise ValueError(f"format {document['format']!r} is not known")
    return UserMesh(
        id=str(document["id"]),
        name=str(document["name"]),
        kind=str(document["kind"]),
        size=int(document["size"]),
        triangles=int(document["triangles"]),
        bounds=np.array(document["bounds"], dtype=np.float64).reshape(2, 3),
        pieces=tuple(np.array(piece, dtype=np.float64).reshape(-1, 3) for piece in document["pieces"]),
        created_at=str(document["created_at"]),
        depth=None if document.get("depth") is None else float(document["depth"]),
        left_out=int(document.get("left_out", 0)),
    )
