"""Signed distances of two convex shapes with witness points, by Coal.

Coal has no type information; everything untyped about it stays in this file. Its algorithms break down now and then
(about one pair of touching cylinders in millions): it is then asked from a hair beside, then about prisms in place of
cylinders, and where it has no answer at all the bodies count as touching.
"""

from __future__ import annotations

import logging
from functools import lru_cache
from itertools import count
from typing import Any, NamedTuple

import coal
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.geometry.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere

log = logging.getLogger(__name__)


class Separation(NamedTuple):
    """How two bodies lie to each other.

    Attributes:
        distance: m; negative where they penetrate (the depth of the shallowest way out).
        point_first: (3,) m, the point of the first body nearest to (or deepest in) the second. point_second: likewise.
        normal: (3,) unit, from the first to the second: ``distance = normal · (point_second - point_first)``.
    """

    distance: float
    point_first: Floats
    point_second: Floats
    normal: Floats


def separation(first: Shape, first_pose: Floats, second: Shape, second_pose: Floats) -> Separation:
    """Signed distance of two shapes at (4, 4) poses in one common frame.

    Good to about 1e-6 m for penetrating cylinders and hulls (the tolerance of the expanding polytope), better else.
    Where Coal has no answer for cylinders, they are prisms that contain them: up to 0.12 % of the radius too near.
    Where it has none at all, the bodies count as `UNKNOWN_DEPTH` deep in each other: contact for a search, and for a
    verification not shown to be clear. That is logged.

    Raises:
        ValueError: two half-spaces.
    """
    if isinstance(first, HalfSpace) and isinstance(second, HalfSpace):
        raise ValueError("two half-spaces have no distance")
    found = _answer(first, first_pose, second, second_pose)
    if found is None and isinstance(first, Cylinder) | isinstance(second, Cylinder):
        found = _answer(_prism(first), first_pose, _prism(second), second_pose)
    if found is not None:
        return found
    log.warning(
        "no distance of %r and %r (the %dth pair without one): they count as touching", first, second, next(_UNANSWERED)
    )
    return _touching(first_pose, second_pose)


_UNANSWERED = count(1)
UNKNOWN_DEPTH = 1e-3
"""m; depth of bodies whose distance Coal does not find: more than the tolerance with which contact is judged."""


def _answer(first: Shape, first_pose: Floats, second: Shape, second_pose: Floats) -> Separation | None:
    """Coal's answer if it can be right, from where it is asked or from a hair beside."""
    for nudge in _NUDGES:
        moved = _shifted(second_pose, nudge * _ASIDE) if nudge else second_pose
        found = _query(first, first_pose, second, moved)
        if _sound(found) and _leads_out(found, first, first_pose, second, moved):
            point = found.point_second - nudge * _ASIDE
            distance = float(found.normal @ (point - found.point_first)) if nudge else found.distance
            return Separation(distance, found.point_first, point, found.normal)
    return None


def _touching(first_pose: Floats, second_pose: Floats) -> Separation:
    """Bodies `UNKNOWN_DEPTH` deep in each other along the line of their centres."""
    way = second_pose[:3, 3] - first_pose[:3, 3]
    length = float(np.linalg.norm(way))
    normal = way / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    middle = 0.5 * (first_pose[:3, 3] + second_pose[:3, 3])
    half = 0.5 * UNKNOWN_DEPTH * normal
    return Separation(-UNKNOWN_DEPTH, middle + half, middle - half, normal)


_SIDES = 64


@lru_cache(maxsize=256)
def _prism(shape: Shape) -> Shape:
    """A regular prism around a cylinder; other shapes as they are."""
    if not isinstance(shape, Cylinder):
        return shape
    angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    ring = shape.radius / np.cos(np.pi / _SIDES) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ends = [np.column_stack([ring, np.full(_SIDES, z)]) for z in (-0.5 * shape.length, 0.5 * shape.length)]
    return ConvexHull(np.vstack(ends))


_NUDGES = (0.0, 1e-7, -1e-6, 1e-5)
"""m; where axes meet or one grazes a surface, the way out is not unique or not seen: look from a hair beside."""

_ASIDE = np.array([0.48, 0.6, 0.64])
"""A unit vector that lies along no usual axis."""


def _sound(found: Separation) -> bool:
    """False for the results that Coal gives where its algorithms break down."""
    return bool(
        abs(found.normal @ found.normal - 1.0) < 1e-6
        and abs(found.normal @ (found.point_second - found.point_first) - found.distance) < 1e-6
    )


def _leads_out(found: Separation, first: Shape, first_pose: Floats, second: Shape, second_pose: Floats) -> bool:
    """True if the second body, moved along the normal by the penetration, is free: Coal's normals may be wrong."""
    if found.distance >= 0.0:
        return True
    out = _query(first, first_pose, second, _shifted(second_pose, -found.distance * found.normal))
    return out.distance > 1e-3 * found.distance - 1e-6


def _shifted(pose: Floats, by: Floats) -> Floats:
    moved = pose.copy()
    moved[:3, 3] += by
    return moved


def _query(first: Shape, first_pose: Floats, second: Shape, second_pose: Floats) -> Separation:
    """Coal's answer as it is."""
    # Coal's own routine for ball and cylinder overlooks the ways out through the flat ends.
    with_cylinder = isinstance(first, Cylinder) or isinstance(second, Cylinder)
    result = coal.DistanceResult()
    distance = coal.distance(
        _geometry(first, with_cylinder),
        _transform(first_pose),
        _geometry(second, with_cylinder),
        _transform(second_pose),
        _REQUEST,
        result,
    )
    return Separation(
        float(distance),
        np.array(result.getNearestPoint1()),
        np.array(result.getNearestPoint2()),
        np.array(result.normal),
    )


def _request() -> Any:
    """Signed distances. A finer ``epa_tolerance`` than Coal's own makes penetrating cylinders fail."""
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_tolerance = 1e-8
    request.epa_tolerance = 1e-6
    request.gjk_max_iterations = 256
    request.epa_max_iterations = 256
    return request


_REQUEST = _request()


def _transform(pose: Floats) -> Any:
    return coal.Transform3s(pose[:3, :3], pose[:3, 3])


@lru_cache(maxsize=4096)
def _geometry(shape: Shape, balls_as_capsules: bool) -> Any:
    """Coal's geometry of a shape (cached; hulls and boxes by identity)."""
    match shape:
        case Box(size=size):
            return coal.Box(*size)
        case Sphere(radius=radius):
            return coal.Capsule(radius, 0.0) if balls_as_capsules else coal.Sphere(radius)
        case Cylinder(radius=radius, length=length):
            return coal.Cylinder(radius, length)
        case Capsule(radius=radius, length=length):
            return coal.Capsule(radius, length)
        case HalfSpace():
            return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        case ConvexHull(points=points):
            corners = coal.StdVec_Vec3s()
            for point in points:
                corners.append(point)
            return coal.ConvexBase.convexHull(corners, True, "Qt")
