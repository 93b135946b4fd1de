"""From the file of a user to a mesh: read, and taken apart into convex pieces. Seconds, if it has dents."""

from __future__ import annotations

import hashlib
from math import floor, log10
from pathlib import Path

import numpy as np

from duocell.models.base.errors import InvalidInput
from duocell.models.geometry.decomposition import decompose
from duocell.models.geometry.meshes import Mesh, read_triangles
from duocell.models.geometry.piece_cache import PieceCache, PiecesInMemory, key_of
from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.library.piece_files import PieceFiles
from duocell.service.library.user_mesh import UserMesh

MOST_PIECES = 32
"""Hulls of a mesh; what it costs to keep clear of it grows with them."""


def mesh_from_file(data: bytes, file: str, name: str, pieces: Path | None = None) -> UserMesh:
    """The mesh in a user's file.

    Args:
        data: contents of the file.
        file: its name; what follows the last dot is the format.
        name: label.
        pieces: folder where convex pieces are kept; None: nowhere.

    Raises:
        InvalidRequest: it cannot be used.
    """
    kind = file.rsplit(".", 1)[-1].lower()
    try:
        mesh = read_triangles(data, kind)
        # Decomposed where its longest side measures 1 to 10: tolerances in metres then fit, whatever the units.
        bounds = np.array([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])
        longest = float(np.ptp(bounds, axis=0).max())
        factor = 10.0 ** -floor(log10(longest)) if longest > 0.0 else 1.0
        cache: PieceCache = PiecesInMemory() if pieces is None else PieceFiles(pieces)
        key = key_of(data, kind, [factor], MOST_PIECES)
        found = cache.find(key)
        if found is None:
            found = decompose(Mesh(mesh.vertices * factor, mesh.faces), MOST_PIECES)
            cache.keep(key, found)
    except InvalidInput as error:
        raise InvalidRequest([Issue("/mesh", error.detail, error.code)]) from error
    return UserMesh(
        id=hashlib.sha256(data).hexdigest()[:32],
        name=name,
        kind=kind,
        size=len(data),
        triangles=len(mesh.faces),
        bounds=bounds,
        pieces=tuple(piece.points / factor for piece in found.pieces),
        created_at="",
        depth=found.dent / factor,
        left_out=found.left_out,
    )
