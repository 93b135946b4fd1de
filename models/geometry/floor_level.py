"""Bodies and a level floor: how high they reach, and whether they are wider below the floor than at it."""

from __future__ import annotations

import numpy as np
import shapely

from duocell.models.base.arrays import Floats
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Sphere

ABOVE = 1e-3
"""m beyond a level that still count as at it: heights are often rounded to a millimetre."""
UPRIGHT = 1e-9
"""Of a cosine; axes that are nearer to the vertical, or to the horizontal, are."""
WIDER = 1e-6
"""m; what a body is wider by at most where that is rounding."""
_OVER = np.diag([1.0, -1.0, -1.0, 1.0])


def lowest(body: Body) -> float:
    """Smallest z [m] of a bounded body in the frame that its pose is given in."""
    down = -body.pose[2, :3]  # the way down, in the shape's frame
    match body.shape:
        case Box(size=size):
            reach = float(0.5 * size @ np.abs(down))
        case Sphere(radius=radius):
            reach = radius
        case Capsule(radius=radius, length=length):
            reach = radius + 0.5 * length * abs(down[2])
        case Cylinder(radius=radius, length=length):
            reach = radius * float(np.hypot(down[0], down[1])) + 0.5 * length * abs(down[2])
        case ConvexHull(points=points):
            reach = float(np.max(points @ down))
        case HalfSpace():
            raise ValueError("a half-space has no lowest point")
    return float(body.pose[2, 3]) - reach


def highest(body: Body) -> float:
    """Largest z [m] of a body in the frame that its pose is given in; infinite for half-spaces that are not level."""
    if isinstance(body.shape, HalfSpace):
        return float(body.pose[2, 3]) if body.pose[2, 2] > 1.0 - UPRIGHT else np.inf
    return -lowest(Body(body.name, _OVER @ body.pose, body.shape))


def ends_at(body: Body, level: float) -> bool:
    """True for a body that something at a level [m] may stand on: it does not reach beyond it."""
    return highest(body) <= level + ABOVE


def bulges_below(body: Body, level: float) -> bool:
    """Whether a body that goes through a level [m] may be wider below it than at it, seen from above.

    False is certain: what stands on the floor and does not hit the body above it would not hit it below either.
    """
    if ends_at(body, level):
        return False
    pose, shape = body.pose, body.shape
    steep, centre = abs(float(pose[2, 2])), float(pose[2, 3])
    match shape:
        case HalfSpace():
            return float(pose[2, 2]) > UPRIGHT
        case Sphere():
            return lowest(body) < level and centre < level
        case Capsule(length=length):
            half = 0.5 * length * steep
            return lowest(body) < level and (centre - half < level if steep < 1.0 - UPRIGHT else centre + half < level)
        case Cylinder():
            lying = steep < UPRIGHT and centre >= level
            return lowest(body) < level and not lying and steep < 1.0 - UPRIGHT
        case Box(size=size):
            corners = 0.5 * size * np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), axis=-1).reshape(-1, 3)
            return _wider_below(corners @ pose[:3, :3].T + pose[:3, 3], level)
        case ConvexHull(points=points):
            return _wider_below(points @ pose[:3, :3].T + pose[:3, 3], level)


def _wider_below(corners: Floats, level: float) -> bool:
    """The same for the hull of points (k, 3) in the world."""
    over, under = corners[corners[:, 2] >= level], corners[corners[:, 2] < level]
    if not len(under) or not len(over):
        return bool(len(under))
    share = ((level - under[:, 2])[:, None] / (over[:, 2] - under[:, 2][:, None]))[..., None]
    met = under[:, None, :2] + share * (over[None, :, :2] - under[:, None, :2])
    section = shapely.MultiPoint(met.reshape(-1, 2)).convex_hull.buffer(WIDER)
    return not bool(section.covers(shapely.MultiPoint(under[:, :2])))
