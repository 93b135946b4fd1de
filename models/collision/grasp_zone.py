"""The part without the neighbourhood of its grasps, where grippers and wrists are allowed to touch it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import transform
from duocell.models.geometry.shapes import SMALLEST, Body, Box, Capsule, ConvexHull, Cylinder, Sphere


def outside_zones(bodies: Iterable[Body], grasps: Floats, zone: float) -> tuple[Body, ...]:
    """What is left of bodies when a cube around each grasp is cut out, as convex pieces.

    The cube has the half size ``zone`` and stands along the axes of the body it is cut from. Capsules and cylinders
    that it holds across lose a length; rounded bodies that stick out of it sideways are replaced by their boxes first,
    which is on the safe side.

    Args:
        bodies: of the part, in the object frame.
        grasps: (a, 3) m, grasp points in the object frame.
        zone: m; nothing is cut if 0.
    """
    pieces = list(bodies)
    if zone > 0.0:
        for grasp in grasps:
            pieces = [piece for body in pieces for piece in _without(body, grasp, zone)]
    return tuple(pieces)


def _without(body: Body, grasp: Floats, zone: float) -> list[Body]:
    """Pieces of one body outside of the zone of one grasp."""
    centre = body.pose[:3, :3].T @ (grasp - body.pose[:3, 3])
    shape = body.shape
    if isinstance(shape, Sphere | Capsule | Cylinder):
        if np.any(np.abs(centre) >= _half(shape) + zone):
            return [body]
        across = 3 if isinstance(shape, Sphere) else 2
        if np.any(np.abs(centre[:across]) + shape.radius > zone):
            shape = Box(2.0 * _half(shape))
    match shape:
        case Box(size=size):
            if np.any(np.abs(centre) >= 0.5 * size + zone):
                return [body]
            return [_box(body, low, high) for low, high in _slabs(-0.5 * size, 0.5 * size, centre, zone)]
        case Sphere():
            return []
        case Capsule() | Cylinder():
            return _shortened(body, shape, centre, zone)
        case ConvexHull():
            return _hull_pieces(body, shape, centre, zone)
        case _:
            raise ValueError(f"{shape!r} cannot be carried")


def _half(shape: Sphere | Capsule | Cylinder) -> Floats:
    """(3,) half sizes of the shape's box."""
    match shape:
        case Sphere(radius=radius):
            return np.full(3, radius)
        case Capsule(radius=radius, length=length):
            return np.array([radius, radius, radius + 0.5 * length])
        case Cylinder(radius=radius, length=length):
            return np.array([radius, radius, 0.5 * length])


def _slabs(low: Floats, high: Floats, centre: Floats, zone: float) -> list[tuple[Floats, Floats]]:
    """A box (corners ``low`` and ``high``) without a cube, as at most six boxes; the long sides are cut first."""
    slabs = []
    low, high = low.copy(), high.copy()
    for axis in np.argsort(low - high, kind="stable"):
        before, after = centre[axis] - zone, centre[axis] + zone
        if before - low[axis] > SMALLEST:
            slabs.append((low.copy(), np.where(np.arange(3) == axis, before, high)))
            low[axis] = before
        if high[axis] - after > SMALLEST:
            slabs.append((np.where(np.arange(3) == axis, after, low), high.copy()))
            high[axis] = after
    return slabs


def _box(body: Body, low: Floats, high: Floats) -> Body:
    return Body(body.name, body.pose @ transform(np.eye(3), 0.5 * (low + high)), Box(high - low))


def _shortened(body: Body, shape: Capsule | Cylinder, centre: Floats, zone: float) -> list[Body]:
    """A thin capsule or cylinder without the length between ``centre - zone`` and ``centre + zone``."""
    half, end = _half(shape), 0.5 * shape.length
    pieces = []
    if centre[2] - zone > SMALLEST - half[2]:
        pieces.append(_length_of(body, shape, -end, max(-end, centre[2] - zone)))
    if centre[2] + zone < half[2] - SMALLEST:
        pieces.append(_length_of(body, shape, min(end, centre[2] + zone), end))
    return pieces


def _length_of(body: Body, shape: Capsule | Cylinder, low: float, high: float) -> Body:
    """The length of a capsule or cylinder between two coordinates along z; a capsule's caps reach beyond both."""
    middle = body.pose @ transform(np.eye(3), [0.0, 0.0, 0.5 * (low + high)])
    if high - low > SMALLEST:
        return Body(body.name, middle, type(shape)(shape.radius, high - low))
    return Body(body.name, middle, Sphere(shape.radius))


def _hull_pieces(body: Body, hull: ConvexHull, centre: Floats, zone: float) -> list[Body]:
    """A hull without a cube: one piece beyond each side of the cube, cut off in turn."""
    low, high = hull.points.min(axis=0), hull.points.max(axis=0)
    if np.any(centre + zone <= low) or np.any(centre - zone >= high):
        return [body]
    pieces = []
    rest: ConvexHull | None = hull
    for axis in np.argsort(low - high, kind="stable"):
        for sign in (1.0, -1.0):
            if rest is not None:
                normal, level = sign * np.eye(3)[axis], sign * centre[axis] + zone
                beyond, rest = _beyond(rest, normal, level), _beyond(rest, -normal, -level)
                if beyond is not None:
                    pieces.append(Body(body.name, body.pose, beyond))
    return pieces


def _beyond(hull: ConvexHull, normal: Floats, level: float) -> ConvexHull | None:
    """The part of a hull with ``normal · x >= level``; None if it has no volume."""
    heights = hull.points @ normal - level
    kept = [point for point, height in zip(hull.points, heights, strict=True) if height >= 0.0]
    for (p, h), (q, g) in combinations(zip(hull.points, heights, strict=True), 2):
        if h * g < 0.0:  # every chord of a convex body lies in it, so chords may stand for edges
            kept.append(p + h / (h - g) * (q - p))
    try:
        return ConvexHull(np.array(kept).reshape(-1, 3))
    except InvalidInput:
        return None
