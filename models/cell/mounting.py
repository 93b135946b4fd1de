"""What a base is mounted on: the one surface that is met straight below its mounting face.

From the mounting face (the underside of a pedestal, the lowest point of a base link whose meshes are known, the face
that the catalogue names, else the base's origin) a ray goes along the base's own -z axis. The first body that it enters
within `DEPTH` carries the arm and does not count against the base link. A body beside the face is never entered: the
ray runs along it, or starts in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.kept import KEPT
from duocell.models.cell.surroundings import Surroundings
from duocell.models.geometry.floor_level import ABOVE, lowest
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from duocell.models.robot.arm import Arm

DEPTH = 0.02
"""m below the mounting face within which the carrying surface is looked for: plates, feet, levelling screws."""
FLUSH = 1e-6
"""m; surfaces met at the same depth are one surface."""
_PARALLEL = 1e-12


def face_depth(surroundings: Surroundings, arm: Arm) -> float:
    """How far [m] the mounting face lies below the base's origin, along the base's -z axis."""
    pedestal = surroundings.of(arm.name).pedestal
    if pedestal is not None:
        return pedestal.height
    meshes = [b.body for b in surroundings.links(arm) if b.link == 0 and b.provenance == "mesh"]
    if meshes:
        return -min(lowest(body) for body in meshes)
    face = arm.robot.mounting_face
    return 0.0 if face is None else -float(face.pose[2, 3])


class Mounting:
    """Bodies in the world that bases may be mounted on."""

    def __init__(self, bodies: Sequence[Body]) -> None:
        """Collect them.

        Args:
            bodies: poses are in the world.
        """
        self._count = len(bodies)
        angular = [isinstance(body.shape, Box | HalfSpace | ConvexHull) for body in bodies]
        flat = [(i, _planes(body)) for i, body in enumerate(bodies) if angular[i]]
        self._flat: Ints = np.array([i for i, _ in flat], dtype=np.int64)
        self._planes: Floats = np.vstack([planes for _, planes in flat]) if flat else np.empty((0, 4))
        self._first: Ints = np.cumsum([0, *(len(planes) for _, planes in flat)])[:-1].astype(np.int64)
        self._round = [(i, body) for i, body in enumerate(bodies) if not angular[i]]

    def carriers(self, bases: Floats, depth: float) -> Bools:
        """(N, B) True for the body that carries a base; more than one only where their surfaces are flush.

        Args:
            bases: (N, 4, 4) in the world. depth: m, of the mounting face below the origin (`face_depth`).
        """
        entered, left = self._crossings(bases, depth, np.zeros(len(bases)))
        met = np.where((entered >= 0.0) & (entered <= left) & (entered <= ABOVE + DEPTH + KEPT), entered, np.inf)
        nearest = np.min(met, axis=1, keepdims=True, initial=np.inf)
        return np.asarray(np.isfinite(met) & (met <= nearest + FLUSH))

    def possible_carriers(self, bases: Floats, depth: float, shifts: Floats) -> Bools:
        """(N, B) False for bodies that carry no base of those that lie around given ones; a True proves nothing.

        Args:
            bases: (N, 4, 4) in the world. depth: m, of the mounting face below the origin.
            shifts: (N,) m, how far the others' origins lie from these at most; their z axes point the same way.
        """
        swollen = np.asarray(shifts, dtype=np.float64) + 2.0 * KEPT
        entered, left = self._crossings(bases, depth, swollen)
        met = (entered <= left) & (left >= 0.0) & (entered <= ABOVE + DEPTH + KEPT)
        return np.asarray(met & self._ahead(bases, depth, swollen))

    def _ahead(self, bases: Floats, depth: float, moved: Floats) -> Bools:
        """(N, B) False for bodies that no ray starting within (N,) m of these enters: it begins inside, or leaves."""
        down = -bases[:, :3, 2]
        start = bases[:, :3, 3] + (depth - ABOVE) * down
        ahead: Bools = np.ones((len(bases), self._count), dtype=np.bool_)
        if len(self._flat):
            heights = start @ self._planes[:, :3].T + self._planes[:, 3] + moved[:, None]
            slopes = down @ self._planes[:, :3].T
            enters = slopes < -_PARALLEL
            latest = np.where(enters, -heights / np.where(enters, slopes, 1.0), -np.inf)
            ahead[:, self._flat] = np.maximum.reduceat(latest, self._first, axis=1) >= 0.0
        for i, body in self._round:
            local = (start - body.pose[:3, 3]) @ body.pose[:3, :3], down @ body.pose[:3, :3]
            ahead[:, i] = _faces(body.shape, *local, moved)
        return ahead

    def _crossings(self, bases: Floats, depth: float, swollen: Floats) -> tuple[Floats, Floats]:
        """(N, B) m, where the rays enter and leave the bodies, swollen by (N,) m; entered > left where they miss."""
        down = -bases[:, :3, 2]
        start = bases[:, :3, 3] + (depth - ABOVE) * down
        entered, left = np.full((len(bases), self._count), np.inf), np.full((len(bases), self._count), -np.inf)
        if len(self._flat):
            heights = start @ self._planes[:, :3].T + self._planes[:, 3] - swollen[:, None]
            slopes = down @ self._planes[:, :3].T
            aside = np.abs(slopes) <= _PARALLEL
            at = -heights / np.where(aside, 1.0, slopes)
            into = np.where(aside, np.where(heights > 0.0, np.inf, -np.inf), np.where(slopes < 0.0, at, -np.inf))
            out = np.where(aside | (slopes < 0.0), np.inf, at)
            entered[:, self._flat] = np.maximum.reduceat(into, self._first, axis=1)
            left[:, self._flat] = np.minimum.reduceat(out, self._first, axis=1)
        for i, body in self._round:
            local = (start - body.pose[:3, 3]) @ body.pose[:3, :3], down @ body.pose[:3, :3]
            entered[:, i], left[:, i] = _through(body.shape, *local, swollen)
        return entered, left


def _planes(body: Body) -> Floats:
    """(f, 4) outer unit normals and offsets in the world: inside is ``n·x + d <= 0``."""
    match body.shape:
        case Box(size=size):
            own = np.column_stack([np.vstack([np.eye(3), -np.eye(3)]), -0.5 * np.tile(size, 2)])
        case HalfSpace():
            own = np.array([[0.0, 0.0, 1.0, 0.0]])
        case ConvexHull(planes=planes):
            own = planes
        case _:
            raise ValueError(f"{body.shape!r} has no flat faces")
    normals = own[:, :3] @ body.pose[:3, :3].T
    return np.column_stack([normals, own[:, 3] - normals @ body.pose[:3, 3]])


def _through(shape: Shape, start: Floats, way: Floats, swollen: Floats) -> tuple[Floats, Floats]:
    """(N,) m, where rays (N, 3) in the shape's frame enter and leave a rounded shape."""
    match shape:
        case Sphere(radius=radius):
            return _through_ball(start, way, radius + swollen)
        case Cylinder(radius=radius, length=length):
            return _through_tube(start, way, radius + swollen, 0.5 * length + swollen)
        case Capsule(radius=radius, length=length):
            end = np.array([0.0, 0.0, 0.5 * length])
            pieces = [_through_ball(start + sign * end, way, radius + swollen) for sign in (1.0, -1.0)]
            pieces.append(_through_tube(start, way, radius + swollen, np.full(len(start), 0.5 * length)))
            missed = [entered > left for entered, left in pieces]
            entered = np.min([np.where(m, np.inf, p[0]) for m, p in zip(missed, pieces, strict=True)], axis=0)
            left = np.max([np.where(m, -np.inf, p[1]) for m, p in zip(missed, pieces, strict=True)], axis=0)
            return entered, left
        case _:
            raise ValueError(f"{shape!r} is not rounded")


def _faces(shape: Shape, start: Floats, way: Floats, moved: Floats) -> Bools:
    """(N,) False where rays (N, 3) that start within (N,) m of these do not enter a rounded shape on their way.

    About an axis that is a point or a segment, the way from its nearest point to the start changes by no more
    than the start does. A ray that goes along it leaves a convex body for good.
    """
    half = 0.0 if isinstance(shape, Sphere) else 0.5 * shape.length if isinstance(shape, Capsule | Cylinder) else np.inf
    if isinstance(shape, Cylinder):
        deep = np.maximum(np.hypot(start[:, 0], start[:, 1]) - shape.radius, np.abs(start[:, 2]) - half)
        upright = np.einsum("ni,ni->n", way[:, :2], way[:, :2]) <= _PARALLEL
        past = upright & (-np.sign(way[:, 2]) * start[:, 2] - half + moved < 0.0)
        return np.asarray((deep >= -moved) & ~past)
    off = start.copy()
    off[:, 2] -= np.clip(off[:, 2], -half, half)
    leaving: Bools = np.einsum("ni,ni->n", off, way) > moved
    return ~leaving


def _through_ball(start: Floats, way: Floats, radius: Floats) -> tuple[Floats, Floats]:
    along = -np.einsum("ni,ni->n", start, way)
    off = start + along[:, None] * way
    half = radius**2 - np.einsum("ni,ni->n", off, off)
    return _around(along, half)


def _through_tube(start: Floats, way: Floats, radius: Floats, half_length: Floats) -> tuple[Floats, Floats]:
    """An upright cylinder: what lies in its mantle and between its flat ends."""
    steep, aside = way[:, 2], np.einsum("ni,ni->n", way[:, :2], way[:, :2])
    upright = aside <= _PARALLEL
    inside = np.hypot(start[:, 0], start[:, 1]) <= radius
    safe = np.where(upright, 1.0, aside)
    along = -np.einsum("ni,ni->n", start[:, :2], way[:, :2]) / safe
    off = start[:, :2] + along[:, None] * way[:, :2]
    mantle = _around(along, (radius**2 - np.einsum("ni,ni->n", off, off)) / safe)
    entered = np.where(upright, np.where(inside, -np.inf, np.inf), mantle[0])
    left = np.where(upright, np.where(inside, np.inf, -np.inf), mantle[1])
    level = np.abs(steep) <= _PARALLEL
    between = np.abs(start[:, 2]) <= half_length
    ends = np.sort(
        np.stack([(sign * half_length - start[:, 2]) / np.where(level, 1.0, steep) for sign in (-1.0, 1.0)]), axis=0
    )
    low = np.where(level, np.where(between, -np.inf, np.inf), ends[0])
    high = np.where(level, np.where(between, np.inf, -np.inf), ends[1])
    return np.maximum(entered, low), np.minimum(left, high)


def _around(middle: Floats, half_squared: Floats) -> tuple[Floats, Floats]:
    """Interval about a middle; empty where the square of its half length is negative."""
    half = np.sqrt(np.maximum(half_squared, 0.0))
    met = half_squared >= 0.0
    return np.where(met, middle - half, np.inf), np.where(met, middle + half, -np.inf)
