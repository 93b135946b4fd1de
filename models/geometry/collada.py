"""Triangles of COLLADA (.dae) files, read with pycollada: no materials, no images, nothing that a file refers to."""

from __future__ import annotations

import io
import re
import warnings
from typing import Any

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.errors import InvalidInput

_DOCTYPE = re.compile(rb"<!(DOCTYPE|ENTITY)", re.IGNORECASE)


def read_collada(data: bytes) -> tuple[Floats, Ints]:
    """Triangles of all geometry in the scene of a file, in metres.

    Where the scene's nodes stand and the unit of the file are applied; the axis that it calls up is not, as in ROS.

    Args:
        data: contents of the file.

    Returns:
        (v, 3) vertices [m] and (f, 3) faces.

    Raises:
        InvalidInput: a document type, a packed file, or an encoding in which one could hide.
        Exception: whatever the reader raises for broken files.
    """
    if data[:2] in (b"PK", b"\xff\xfe", b"\xfe\xff") or b"\0" in data[:1000] or _DOCTYPE.search(data):
        raise InvalidInput("a .dae file is needed that is neither packed nor UTF-16 and has no document type.", "/mesh")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the library uses what NumPy will drop one day
        return _read(data)


def _read(data: bytes) -> tuple[Floats, Ints]:
    import collada  # a fifth of a second that only cells with such meshes need
    from collada.common import DaeError

    document = collada.Collada(io.BytesIO(data), ignore=[DaeError])
    unit = document.assetInfo.unitmeter if document.assetInfo is not None else None
    vertices, faces, count = [], [], 0
    for geometry in document.scene.objects("geometry") if document.scene is not None else ():
        for primitive in geometry.primitives():
            triangles = _triangles(primitive)
            if triangles is not None:
                vertices.append(triangles[0])
                faces.append(triangles[1] + count)
                count += len(triangles[0])
    if not vertices:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    return np.vstack(vertices) * (1.0 if unit is None else float(unit)), np.vstack(faces)


def _triangles(primitive: Any) -> tuple[Floats, Ints] | None:
    """Vertices and faces of a part of a geometry, placed in the scene; None for points and lines."""
    if hasattr(primitive, "triangleset"):  # polygons
        primitive = primitive.triangleset()
    index = getattr(primitive, "vertex_index", None)
    if index is None or np.ndim(index) != 2 or np.shape(index)[1] != 3:
        return None
    return np.asarray(primitive.vertex, dtype=np.float64), np.asarray(index, dtype=np.int64)
