"""Bounding capsules and boxes, and distances between many of them at once: lower bounds that spare exact queries.

A bounding capsule is a segment with a radius; it is exact for spheres and capsules, so the bounds between these are
their signed distances. Bounds may be negative where nothing touches, and never exceed the true signed distance by more
than `ROUNDING`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from duocell.models.base.arrays import Floats, set_frozen
from duocell.models.geometry.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere

ROUNDING = 1e-9
"""m; what rounding may add to a bound, and is taken off again."""


@dataclass(frozen=True, eq=False)
class Bounding:
    """What surely contains a shape, in the shape's frame.

    Attributes:
        ends: (2, 3) m, ends of the capsule's segment. radius: m.
        centre: (3,) m of a box along the frame's axes. half: (3,) m, its half sizes.
        exact: True if the capsule is the shape itself.
    """

    ends: Floats
    radius: float
    centre: Floats
    half: Floats
    exact: bool

    def __post_init__(self) -> None:
        set_frozen(self, "ends", self.ends, (2, 3))
        set_frozen(self, "centre", self.centre, (3,))
        set_frozen(self, "half", self.half, (3,))


def bounding(shape: Shape) -> Bounding:
    """Capsule and box around a shape.

    Raises:
        ValueError: a half-space, which nothing bounds.
    """
    match shape:
        case Box(size=size):
            along = np.eye(3)[np.argmax(size)] * size
            radius = 0.5 * float(np.linalg.norm(size - along))
            return Bounding(0.5 * np.array([-along, along]), radius, np.zeros(3), 0.5 * size, exact=False)
        case Sphere(radius=radius):
            return Bounding(np.zeros((2, 3)), radius, np.zeros(3), np.full(3, radius), exact=True)
        case Capsule(radius=radius, length=length):
            half = np.array([radius, radius, radius + 0.5 * length])
            return Bounding(_along_z(length), radius, np.zeros(3), half, exact=True)
        case Cylinder(radius=radius, length=length):
            half = np.array([radius, radius, 0.5 * length])
            return Bounding(_along_z(length), radius, np.zeros(3), half, exact=False)
        case ConvexHull():
            return _around_hull(shape)
        case HalfSpace():
            raise ValueError("a half-space has no bounds")


@lru_cache(maxsize=4096)
def _around_hull(hull: ConvexHull) -> Bounding:
    """Bounds of a hull, kept by identity: they take a millisecond, and cells of a thousand pieces are built often."""
    ends, radius = enclosing_capsule(hull.points)
    low, high = hull.points.min(axis=0), hull.points.max(axis=0)
    return Bounding(ends, radius, 0.5 * (low + high), 0.5 * (high - low), exact=False)


def _along_z(length: float) -> Floats:
    return np.array([[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]])


def enclosing_capsule(points: Floats) -> tuple[Floats, float]:
    """A small capsule around points (k, 3): the best of those along the coordinate and the principal axes.

    Returns:
        (2, 3) ends of its segment [m] and its radius [m].
    """
    principal = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    capsules = [_capsule_along(points, axis) for axis in (*np.eye(3), *principal)]
    return min(capsules, key=lambda c: (c[1] ** 2 * (np.linalg.norm(c[0][1] - c[0][0]) + 4.0 / 3.0 * c[1]), c[1]))


def _capsule_along(points: Floats, axis: Floats) -> tuple[Floats, float]:
    """The capsule around points with a segment parallel to a unit axis."""
    along = points @ axis
    flat = points - along[:, None] * axis
    centre = _disc_centre(flat)
    aside = np.linalg.norm(flat - centre, axis=1)
    radius = float(aside.max())
    cap = np.sqrt(np.maximum(radius**2 - aside**2, 0.0))  # how far a cap reaches over a point
    low, high = float(np.min(along + cap)), float(np.max(along - cap))
    if low > high:  # one ball suffices
        low = high = 0.5 * (low + high)
    ends = centre + np.array([[low], [high]]) * axis
    slack = float(np.max(_from_segment(points, ends))) - radius
    return ends, radius + max(slack, 0.0)


def _disc_centre(flat: Floats) -> Floats:
    """Near the centre of the smallest ball around points: ever shorter steps to the farthest (Bădoiu, Clarkson)."""
    centre: Floats = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    best, least = centre, np.inf
    for step in range(1, 31):
        away = flat - centre
        squares = np.einsum("ka,ka->k", away, away)
        farthest = int(np.argmax(squares))
        if squares[farthest] < least:
            best, least = centre, float(squares[farthest])
        centre = centre + away[farthest] / (step + 1)
    return best


def _from_segment(points: Floats, ends: Floats) -> Floats:
    """(k,) distances of points from a segment."""
    way = ends[1] - ends[0]
    share = np.clip((points - ends[0]) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
    distances: Floats = np.linalg.norm(points - ends[0] - share[:, None] * way, axis=1)
    return distances


def segment_distances(first: Floats, second: Floats) -> Floats:
    """Distances of segments.

    Args:
        first: (..., 2, 3) ends [m]. second: (..., 2, 3).

    Returns:
        (...) m.
    """
    u, v = first[..., 1, :] - first[..., 0, :], second[..., 1, :] - second[..., 0, :]
    r = first[..., 0, :] - second[..., 0, :]
    a, e, b = _dot(u, u), _dot(v, v), _dot(u, v)
    c, f = _dot(u, r), _dot(v, r)
    determinant = a * e - b * b
    apart = determinant > 1e-12 * a * e  # else parallel: any start will do, the next two lines find the rest
    s = np.where(apart, np.clip((b * f - c * e) / np.where(apart, determinant, 1.0), 0.0, 1.0), 0.0)
    t = np.clip((b * s + f) / np.maximum(e, 1e-300), 0.0, 1.0)
    s = np.clip((b * t - c) / np.maximum(a, 1e-300), 0.0, 1.0)
    gap = r + s[..., None] * u - t[..., None] * v
    distances: Floats = np.sqrt(_dot(gap, gap))
    return distances


def box_distances(ends: Floats, half: Floats) -> Floats:
    """Lower bounds of the signed distances of segments from boxes: those of the segments' own boxes.

    Args:
        ends: (..., 2, 3) m, in the frame of the box, centred on it. half: (..., 3) m.
    """
    low, high = np.minimum(ends[..., 0, :], ends[..., 1, :]), np.maximum(ends[..., 0, :], ends[..., 1, :])
    gap = np.maximum(low - half, -half - high)
    apart = np.maximum(gap, 0.0)
    distances: Floats = np.sqrt(_dot(apart, apart)) + np.minimum(np.max(gap, axis=-1), 0.0)
    return distances


def exact_box_distances(ends: Floats, half: Floats) -> Floats:
    """Distances (...) of segments from boxes, 0 where they meet; arguments as for `box_distances`.

    Along a segment the squared distance is convex and made of parabolas that join where a coordinate passes a side of
    the box; the slope is linear between these places, so its root is found exactly.
    """
    shape = ends.shape[:-2]
    flat: Floats = ends.reshape(-1, 2, 3)
    sides: Floats = np.broadcast_to(half, (*shape, 3)).reshape(-1, 3)
    start, way = flat[:, 0], flat[:, 1] - flat[:, 0]
    places = np.zeros((len(flat), 8))
    with np.errstate(divide="ignore", invalid="ignore"):
        places[:, :3], places[:, 3:6] = (sides - start) / way, (-sides - start) / way
    places[:, 7] = 1.0
    places = np.sort(np.fmin(np.fmax(places, 0.0), 1.0), axis=1)  # 0/0 counts as 0
    points = start[:, None] + places[..., None] * way[:, None]
    beyond = points - np.fmin(np.fmax(points, -sides[:, None]), sides[:, None])
    slopes = np.einsum("qka,qa->qk", beyond, way)
    row = np.arange(len(flat))
    last = np.minimum(np.maximum(np.count_nonzero(slopes <= 0.0, axis=1) - 1, 0), 6)
    before, left = slopes[row, last], places[row, last]
    rise = slopes[row, last + 1] - before
    share = np.where(rise > 0.0, np.fmin(np.fmax(-before / np.where(rise > 0.0, rise, 1.0), 0.0), 1.0), 0.0)
    nearest = start + (left + share * (places[row, last + 1] - left))[:, None] * way
    apart = nearest - np.fmin(np.fmax(nearest, -sides), sides)
    distances: Floats = np.sqrt(_dot(apart, apart)).reshape(shape)
    return distances


def box_gaps(first: Floats, first_half: Floats, second: Floats, second_half: Floats) -> Floats:
    """Lower bounds of the signed distances of boxes: the widest gap along their axes and the normals of edge pairs.

    S. Gottschalk et al., OBBTree, SIGGRAPH 1996. Exact where a face is nearest to a corner, an edge or a face.

    Args:
        first: (..., 4, 4) centres and axes. first_half: (..., 3) m. second, second_half: likewise.

    Returns:
        (...) m.
    """
    turn = first[..., :3, :3].swapaxes(-1, -2) @ second[..., :3, :3]
    shift = ((second[..., :3, 3] - first[..., :3, 3])[..., None, :] @ first[..., :3, :3])[..., 0, :]
    size = np.abs(turn)
    of_first = np.abs(shift) - first_half - (size @ second_half[..., None])[..., 0]
    seen = (shift[..., None, :] @ turn)[..., 0, :]
    of_second = np.abs(seen) - second_half - (first_half[..., None, :] @ size)[..., 0, :]
    gaps: Floats = np.maximum(np.max(of_first, axis=-1), np.max(of_second, axis=-1))
    for i in range(3):  # normals of the first box's axis i with each of the second's: e_i x turn[:, j]
        j, k = (i + 1) % 3, (i + 2) % 3
        length = np.sqrt(np.maximum(1.0 - turn[..., i, :] ** 2, 0.0))
        apart = np.abs(shift[..., k, None] * turn[..., j, :] - shift[..., j, None] * turn[..., k, :])
        reach = first_half[..., j, None] * size[..., k, :] + first_half[..., k, None] * size[..., j, :]
        other = np.stack([_others(second_half, size[..., i, :], column) for column in range(3)], axis=-1)
        askew = length > 1e-3  # nearly parallel edges: the faces say the same
        edge = (apart - reach - other) / np.where(askew, length, 1.0)
        gaps = np.maximum(gaps, np.max(np.where(askew, edge, -np.inf), axis=-1))
    return gaps


def _others(half: Floats, size: Floats, column: int) -> Floats:
    """What the second box reaches along the normal of the first's axis i and its own axis ``column``."""
    j, k = (column + 1) % 3, (column + 2) % 3
    reach: Floats = half[..., j] * size[..., k] + half[..., k] * size[..., j]
    return reach


def _dot(x: Floats, y: Floats) -> Floats:
    product: Floats = np.einsum("...a,...a->...", x, y)
    return product
