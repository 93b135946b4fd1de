"""Triangle meshes from STL and OBJ files, and the convex hulls that stand for them.

A mesh is taken apart into its connected pieces; a piece that is convex becomes its hull, any other is decomposed with
CoACD (X. Wei et al., ACM Trans. Graph. 41, 2022) into a few hulls that together contain it. Hulls fill small dents, so
they err on the safe side.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull as Hull
from scipy.spatial import QhullError

from models.arrays import Floats, Ints, set_frozen
from models.errors import InvalidInput
from models.few_corners import enclosing_corners
from models.shapes import LARGEST, ConvexHull

FORMATS = ("stl", "obj")

MOST_TRIANGLES = 200_000
"""More than that is a visual model; a collision model has a hundredth."""

FARTHEST = 1e9
"""In the units of a file, whatever they are."""

CONVEX = 1e-3
"""Share of its hull's volume that a piece may lack and still count as convex."""

CONCAVITY = 0.05
"""Largest dent that a decomposition leaves filled, relative to half of the longest side of the piece."""

SHALLOW = 0.01
"""m; dents that are no deeper may be filled in small pieces too: screw heads and ribs are not worth a hundred hulls."""

MISSED = 1e-3
"""m; a decomposition from which the mesh sticks out farther than this is not used, the hull of the whole piece is."""


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


def read_mesh(data: bytes, kind: str, scale: float = 1.0) -> Mesh:
    """The mesh of a file in metres.

    Args:
        data: see `read_triangles`. kind: likewise.
        scale: factor to metres, 0.001 for a file in millimetres.

    Raises:
        InvalidInput: see `read_triangles`, or coordinates that make no sense.
    """
    if not np.isfinite(scale) or scale <= 0.0:
        raise InvalidInput(f"scale is {scale:g}; it must be positive.", "/scale")
    return in_metres(read_triangles(data, kind), np.full(3, scale))


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
        kind: "stl" or "obj", in any case.

    Raises:
        InvalidInput: another format, unreadable, too many triangles, or coordinates that make no sense.
    """
    suffix = kind.lower().lstrip(".")
    if suffix not in FORMATS:
        raise InvalidInput(
            f"meshes are read from {' and '.join(FORMATS)} files; got {kind[:20]!r}. Convert it, for example with "
            "Blender, MeshLab or `trimesh.load(file).export(...)`.",
            "/mesh",
        )
    import trimesh  # a tenth of a second that only cells with meshes need

    options: dict[str, Any] = {"skip_materials": True} if suffix == "obj" else {}
    try:
        loaded = trimesh.load_mesh(io.BytesIO(data), file_type=suffix, process=False, **options)
        vertices = np.asarray(loaded.vertices, dtype=np.float64)
        faces = np.asarray(loaded.faces, dtype=np.int64)
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


def convex_pieces(mesh: Mesh) -> tuple[ConvexHull, ...]:
    """Hulls that together contain the mesh; the same ones every time. Seconds for a piece with dents.

    Raises:
        InvalidInput: the mesh encloses no volume.
    """
    pieces: list[ConvexHull] = []
    flat: list[Ints] = []
    for faces in _connected(mesh):
        found = _pieces_of(mesh.vertices, faces)
        pieces += found
        if not found:
            flat.append(np.unique(faces))
    return (*pieces, *_around_flat(mesh.vertices, flat, pieces))


def _pieces_of(vertices: Floats, faces: Ints) -> list[ConvexHull]:
    """Hulls of one connected part; none if it is flat."""
    used = np.unique(faces)
    if len(used) < 4:
        return []
    try:
        around = Hull(vertices[used])
        hull = ConvexHull(enclosing_corners(around))
    except (InvalidInput, QhullError):
        return []
    whole = abs(_signed_volume(vertices, faces)) >= (1.0 - CONVEX) * around.volume
    return [hull] if whole else _decomposed(vertices, faces, hull)


def _around_flat(vertices: Floats, flat: Sequence[Ints], pieces: Sequence[ConvexHull]) -> list[ConvexHull]:
    """The hull of all flat parts, unless they lie inside of the pieces: the sides of a solid may not hang together.

    Raises:
        InvalidInput: they have no volume even together, but stick out.
    """
    if not flat:
        return []
    points = vertices[np.unique(np.concatenate(flat))]
    if pieces and _sticking_out(points, pieces) <= MISSED:
        return []
    try:
        return [ConvexHull(enclosing_corners(Hull(points)))]
    except (InvalidInput, QhullError) as error:
        what = "a part of the mesh" if pieces else "the mesh"
        raise InvalidInput(f"{what} encloses no volume; a solid is needed.", "/mesh") from error


def _connected(mesh: Mesh) -> list[Ints]:
    """Faces (f, 3) of each part of the mesh that hangs together."""
    first, second = mesh.faces[:, [0, 1]].ravel(), mesh.faces[:, [1, 2]].ravel()
    count = len(mesh.vertices)
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    _, labels = connected_components(graph, directed=False)
    of_face = labels[mesh.faces[:, 0]]
    order = np.argsort(of_face, kind="stable")
    return np.split(mesh.faces[order], np.flatnonzero(np.diff(of_face[order])) + 1)


def _signed_volume(vertices: Floats, faces: Ints) -> float:
    """Volume [m³] inside closed triangles (divergence theorem), about their middle so that rounding stays small."""
    a, b, c = (vertices[faces[:, i]] - vertices[faces].mean(axis=(0, 1)) for i in range(3))
    return float(np.einsum("fa,fa->", a, np.cross(b, c))) / 6.0


def _decomposed(vertices: Floats, faces: Ints, hull: ConvexHull) -> list[ConvexHull]:
    """Hulls of one piece with dents."""
    import coacd

    coacd.set_log_level("error")
    used, index = np.unique(faces, return_inverse=True)
    half = 0.5 * float(np.ptp(vertices[used], axis=0).max())
    parts = coacd.run_coacd(
        coacd.Mesh(vertices[used], index.reshape(-1, 3)),
        threshold=min(1.0, max(CONCAVITY, SHALLOW / half)),
        mcts_iterations=60,
        mcts_nodes=10,
        seed=0,
    )
    hulls = []
    for points, _ in parts:
        try:
            hulls.append(ConvexHull(enclosing_corners(Hull(points))))
        except (InvalidInput, QhullError):
            continue
    return hulls if hulls and _sticking_out(vertices[used], hulls) <= MISSED else [hull]


def _sticking_out(points: Floats, hulls: Sequence[ConvexHull]) -> float:
    """How far [m] the worst of the points lies outside of all hulls (at most; measured along normals of faces)."""
    worst = -np.inf
    for some in np.array_split(points, 1 + len(points) // 10_000):  # tens of megabytes at a time
        beyond = [np.max(some @ hull.planes[:, :3].T + hull.planes[:, 3], axis=1) for hull in hulls]
        worst = max(worst, float(np.max(np.min(beyond, axis=0))))
    return worst
