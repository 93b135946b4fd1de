"""Convex hulls that stand for a mesh: few of them, and together they contain it.

Parts of the mesh that hang together and are nearly convex become their hulls. Others are cut along planes, the one with
the deepest dent first, each along the plane that leaves the least volume, until no dent is deeper than what is worth a
hull or there are as many hulls as allowed. What is cut off is hulled with its section, so nothing of a solid is lost.
The work grows with the triangles and the hulls alone; the hulls are the same ones every time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull as Hull
from scipy.spatial import QhullError

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.errors import InvalidInput
from duocell.models.geometry.concavity import deepest_dent
from duocell.models.geometry.hull_simplification import enclosing_corners
from duocell.models.geometry.meshes import Mesh
from duocell.models.geometry.plane_cuts import best_cut, cut_apart
from duocell.models.geometry.shapes import ConvexHull

MOST_PIECES = 8
"""Hulls of a mesh, unless told otherwise."""

CONCAVITY = 0.05
"""Depth of dents that are left filled, relative to half of the longest side of the mesh."""

SHALLOW = 0.01
"""m; dents that are no deeper may be filled in small pieces too: screw heads and ribs are not worth a hull."""

WORTH = 5e-3
"""Share of the hull's volume that each hull more must save: narrow bores stay filled."""

MISSED = 1e-3
"""m; flat parts that stick out of the hulls by no more are left out in silence."""

MANY_PARTS = 64
"""A mesh of more parts is looked at as one."""


@dataclass(frozen=True, eq=False, slots=True)
class Decomposition:
    """Hulls in the place of a mesh.

    Attributes:
        pieces: together they contain every part of the mesh that has volume.
        dent: m, deepest dent that they fill, as sampled: how far they stick out of the mesh.
        left_out: parts without volume that stick out of the pieces, and are not contained.
        extent: (3,) m, sides of the box along the axes that holds the mesh.
    """

    pieces: tuple[ConvexHull, ...]
    dent: float
    left_out: int
    extent: Floats


@dataclass(eq=False, slots=True)
class _Part:
    """Triangles (f, 3, 3), their hull, the planes (k, 4) that they were cut along, and the deepest dent [m]."""

    triangles: Floats
    hull: Hull
    cuts: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    dent: float = 0.0
    halves: tuple[_Part, ...] = ()
    settled: bool = False

    def leaves(self, worth: float) -> list[_Part]:
        """What it was cut into, as far as every hull more saves ``worth`` of volume."""
        found = [leaf for half in self.halves for leaf in half.leaves(worth)]
        saved = self.hull.volume - sum(leaf.hull.volume for leaf in found)
        return found if found and saved >= worth * (len(found) - 1) else [self]


def decompose(mesh: Mesh, most: int = MOST_PIECES) -> Decomposition:
    """Hulls in the place of a mesh.

    Args:
        mesh: in metres.
        most: hulls.

    Raises:
        InvalidInput: the mesh encloses no volume.
    """
    parts, flat = _parts(mesh)
    if len(parts) > most:
        parts = [_Part(triangles, hull) for triangles, hull in [_as_one(parts)]]
    deep = max(CONCAVITY * 0.5 * float(np.ptp(mesh.vertices, axis=0).max()), SHALLOW)
    for part in parts:
        part.dent = deepest_dent(part.hull, part.triangles, part.cuts)
    worth = WORTH * sum(part.hull.volume for part in parts)
    _cut(list(parts), deep, most)
    parts = _joined([leaf for part in parts for leaf in part.leaves(worth)], worth)
    pieces = []
    for part in parts:
        try:
            pieces.append(ConvexHull(enclosing_corners(part.hull)))
        except (InvalidInput, QhullError):  # thinner than any solid
            flat.append(part.triangles)
    more, left_out = _around_flat(flat, pieces)
    dent = max((part.dent for part in parts), default=0.0)
    return Decomposition((*pieces, *more), dent, left_out, np.ptp(mesh.vertices, axis=0))


def _cut(parts: list[_Part], deep: float, most: int) -> None:
    """Cut the part with the deepest dent, again and again; rings are quartered before that saves anything."""
    while len(parts) < most:
        waiting = [part for part in parts if not part.settled and part.dent > deep]
        if not waiting:
            return
        part = max(waiting, key=lambda one: one.dent)
        part.halves, part.settled = _halves(part), True
        if part.halves:
            parts.remove(part)
            parts += part.halves


def _joined(parts: list[_Part], worth: float) -> list[_Part]:
    """Parts put together again where one hull holds as little as two: cuts were made one by one."""
    while True:
        pairs = [_together(one, other, worth) for one, other in combinations(parts, 2)]
        whole = min((pair for pair in pairs if pair is not None), key=lambda pair: pair[0], default=None)
        if whole is None:
            return parts
        _, one, other, hull = whole
        triangles = np.concatenate([one.triangles, other.triangles])
        merged = _Part(triangles, hull, np.vstack([one.cuts, other.cuts]), max(one.dent, other.dent))
        parts = [part for part in parts if part is not one and part is not other] + [merged]


def _together(one: _Part, other: _Part, worth: float) -> tuple[float, _Part, _Part, Hull] | None:
    """Volume that a common hull adds, the parts, and that hull; None if it adds more than half of what is worth one."""
    if not len(one.cuts) or not len(other.cuts):
        return None
    corners = [part.hull.points[part.hull.vertices] for part in (one, other)]
    hull = Hull(np.concatenate(corners))
    added = float(hull.volume - one.hull.volume - other.hull.volume)
    return (added, one, other, hull) if added <= 0.5 * worth else None


def _parts(mesh: Mesh) -> tuple[list[_Part], list[Floats]]:
    """Parts that hang together and have volume, without those inside of others; and the triangles of flat ones."""
    solid, flat = [], []
    for faces in _connected(mesh):
        triangles = mesh.vertices[faces]
        hull = _hull(triangles)
        if hull is None:
            flat.append(triangles)
        else:
            solid.append(_Part(triangles, hull))
    solid.sort(key=lambda part: -part.hull.volume)
    kept: list[_Part] = []
    for part in solid:
        corners = part.hull.points[part.hull.vertices]
        if len(solid) > MANY_PARTS or not any(_beyond(corners, one.hull) <= 0.0 for one in kept):
            kept.append(part)
    return kept, flat


def _hull(triangles: Floats) -> Hull | None:
    """The hull of triangles; None if they lie in a plane."""
    points = np.unique(triangles.reshape(-1, 3), axis=0)
    if len(points) < 4:
        return None
    try:
        return Hull(points)
    except QhullError:
        return None


def _as_one(parts: Sequence[_Part]) -> tuple[Floats, Hull]:
    triangles = np.concatenate([part.triangles for part in parts])
    return triangles, Hull(np.unique(triangles.reshape(-1, 3), axis=0))


def _halves(part: _Part) -> tuple[_Part, ...]:
    """A part cut in two; empty if no plane leaves two solids."""
    cut = best_cut(part.triangles)
    if cut is None:
        return ()
    halves = []
    for triangles in cut_apart(part.triangles, cut.plane):
        hull = _hull(triangles)
        if hull is None:
            return ()
        half = _Part(triangles, hull, np.vstack([part.cuts, cut.plane]))
        half.dent = deepest_dent(hull, triangles, half.cuts)
        halves.append(half)
    return tuple(halves)


def _around_flat(flat: Sequence[Floats], pieces: Sequence[ConvexHull]) -> tuple[list[ConvexHull], int]:
    """The hull of all flat parts, unless they lie inside of the pieces: the sides of a solid may not hang together.

    Returns:
        Hulls, and how many parts were left out because they have no volume even together.

    Raises:
        InvalidInput: nothing has volume.
    """
    outside = [one for one in flat if not pieces or sticking_out(one.reshape(-1, 3), pieces) > MISSED]
    if not outside:
        return [], 0
    try:
        return [ConvexHull(enclosing_corners(Hull(np.unique(np.concatenate(outside).reshape(-1, 3), axis=0))))], 0
    except (InvalidInput, QhullError, ValueError):
        pass
    if not pieces:
        raise InvalidInput("the mesh encloses no volume; a solid is needed.", "/mesh")
    return [], len(outside)


def _connected(mesh: Mesh) -> list[Ints]:
    """Faces (f, 3) of each part of the mesh that hangs together."""
    first, second = mesh.faces[:, [0, 1]].ravel(), mesh.faces[:, [1, 2]].ravel()
    count = len(mesh.vertices)
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    _, labels = connected_components(graph, directed=False)
    of_face = labels[mesh.faces[:, 0]]
    order = np.argsort(of_face, kind="stable")
    return np.split(mesh.faces[order], np.flatnonzero(np.diff(of_face[order])) + 1)


def _beyond(points: Floats, hull: Hull) -> float:
    """How far the farthest of the points is outside of a hull."""
    return float(np.max(points @ hull.equations[:, :3].T + hull.equations[:, 3]))


def sticking_out(points: Floats, hulls: Sequence[ConvexHull]) -> float:
    """How far [m] the worst of the points lies outside of all hulls (at most; measured along normals of faces)."""
    worst = -np.inf
    for some in np.array_split(points, 1 + len(points) // 10_000):  # tens of megabytes at a time
        beyond = [np.max(some @ hull.planes[:, :3].T + hull.planes[:, 3], axis=1) for hull in hulls]
        worst = max(worst, float(np.max(np.min(beyond, axis=0))))
    return worst
