"""Triangle meshes from STL, OBJ and COLLADA files; hulls in their place: `duocell.models.geometry.decomposition`."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any

import numpy as np

from duocell.models.base.arrays import Floats, Ints, set_frozen
from duocell.models.base.errors import InvalidInput
from duocell.models.geometry.collada import read_collada
from duocell.models.geometry.shapes import LARGEST

FORMATS = ("stl", "obj", "dae")

MOST_TRIANGLES = 200_000
"""More than that is a visual model; a collision model has a hundredth."""

FARTHEST = 1e9
"""In the units of a file, whatever they are."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles.

    Attributes:
        vertices: (v, 3) m.
        faces: (f, 3) indices of vertices, counter-clockwise seen from outside.
    """

    vertices: Floats
    faces: Ints

    def __post_init__(self) -> None:
        set_frozen(self, "vertices", self.vertices, (None, 3))
        faces = np.array(self.faces, dtype=np.int64)
        faces.setflags(write=False)
        object.__setattr__(self, "faces", faces)


def in_metres(mesh: Mesh, scale: Floats) -> Mesh:
    """A mesh stretched along its axes.

    Args:
        mesh: in the units of its file.
        scale: (3,) factors to metres, not 0; an odd number of negative ones mirrors the solid.

    Raises:
        InvalidInput: a vertex farther away than any workcell is large.
    """
    vertices = mesh.vertices * scale
    if np.abs(vertices).max() > LARGEST:
        raise InvalidInput(f"a vertex is beyond {LARGEST:g} m; is the scale right (0.001 for millimetres)?", "/scale")
    return Mesh(vertices, mesh.faces if np.prod(scale) > 0.0 else mesh.faces[:, ::-1])


def read_triangles(data: bytes, kind: str) -> Mesh:
    """The mesh of a file in its own units; equal vertices are merged.

    Nothing but ``data`` is read, whatever a file refers to.

    Args:
        data: contents of the file.
        kind: "stl", "obj" or "dae", in any case; the latter tells its unit, and is in metres.

    Raises:
        InvalidInput: another format, unreadable, too many triangles, or coordinates that make no sense.
    """
    suffix = kind.lower().lstrip(".")
    if suffix not in FORMATS:
        raise InvalidInput(
            f"meshes are read from {', '.join(FORMATS)} files; got {kind[:20]!r}. Convert it, for example with "
            "Blender, MeshLab or `trimesh.load(file).export(...)`.",
            "/mesh",
        )
    try:
        vertices, faces = read_collada(data) if suffix == "dae" else _loaded(data, suffix)
    except InvalidInput:
        raise
    except Exception as error:  # the readers raise whatever broken bytes lead to
        raise InvalidInput(f"this is no readable {suffix} file ({type(error).__name__}).", "/mesh") from error
    if len(faces) == 0:
        raise InvalidInput(f"no triangles were found; is this a complete {suffix} file?", "/mesh")
    if len(faces) > MOST_TRIANGLES:
        raise InvalidInput(
            f"the mesh has {len(faces)} triangles; at most {MOST_TRIANGLES} are accepted. "
            "Send a simplified collision model.",
            "/mesh",
        )
    if not np.all(np.isfinite(vertices)) or np.abs(vertices).max() > FARTHEST:
        raise InvalidInput(f"a vertex is not finite or beyond {FARTHEST:g} in the file's own units.", "/mesh")
    unique, index = np.unique(vertices, axis=0, return_inverse=True)
    return Mesh(unique, index.reshape(-1)[faces])


def _loaded(data: bytes, suffix: str) -> tuple[Floats, Ints]:
    """Vertices (v, 3) and faces (f, 3) as trimesh reads them."""
    import trimesh  # a tenth of a second that only cells with meshes need

    options: dict[str, Any] = {"skip_materials": True} if suffix == "obj" else {}
    loaded = trimesh.load_mesh(io.BytesIO(data), file_type=suffix, process=False, **options)
    return np.asarray(loaded.vertices, dtype=np.float64), np.asarray(loaded.faces, dtype=np.int64)
