"""Rules for bases read a second time, with plain numbers and Shapely: region, floor, couplings."""

from __future__ import annotations

from math import cos, dist, inf, pi, sin

import numpy as np
from shapely import Polygon
from shapely.geometry import MultiPoint, Point

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, Rigid, SameHeight
from duocell.models.cell.floor import POINT
from duocell.models.robot.arm import Arm, Interval

TURN = 2.0 * pi


def region_excess(arm: Arm, stand: Floats) -> float:
    """How far a base (x, y, z, yaw) is outside its region, m or rad; 0 if it is not."""
    sides = zip(stand[:3], (arm.base.x, arm.base.y, arm.base.z), strict=True)
    return max(*(_outside(float(value), side) for value, side in sides), _turned_outside(float(stand[3]), arm.base.yaw))


def _outside(value: float, interval: Interval) -> float:
    return max(0.0, interval.low - value, value - interval.high)


def _turned_outside(yaw: float, interval: Interval) -> float:
    """The same for an angle that counts modulo a turn."""
    first = int((interval.low - yaw) // TURN)
    return min(_outside(yaw + TURN * k, interval) for k in range(first, first + 3))


def floor_gap(cell: Cell, index: int, stand: Floats) -> float:
    """How far [m] an arm's footprint is from where it must not be, beyond the margin; negative: it is there.

    The footprint is the arm's own, else its pedestal's, else the base origin alone.
    """
    floor = cell.surroundings.floor
    if floor is None:
        return inf
    brings = cell.surroundings.of(cell.arms[index].name)
    plate = brings.footprint or (brings.pedestal.footprint if brings.pedestal is not None else POINT)
    turned = (cell.arms[index].mount @ rotation_z(float(stand[3])))[:2, :2]
    ground = MultiPoint(plate.corners @ turned.T + stand[:2]).convex_hull
    gaps = [inf]
    if floor.allowed is not None:
        allowed = Polygon(floor.allowed)
        if allowed.contains(ground):
            gaps.append(allowed.exterior.distance(ground))
        else:
            gaps.append(-max(allowed.distance(Point(corner)) for corner in _corners(ground)))
    for polygon in floor.forbidden:
        forbidden = Polygon(polygon)
        overlap = forbidden.intersection(ground)
        gap = forbidden.distance(ground)
        if gap == 0.0:  # how far in, roughly: the farthest corner of what is common from the rim
            gap = -max(forbidden.exterior.distance(Point(corner)) for corner in _corners(overlap))
        gaps.append(gap)
    return min(gaps) - plate.radius - floor.margin


def _corners(shape: object) -> list[tuple[float, float]]:
    """Corners of any simple Shapely geometry."""
    outline = getattr(shape, "exterior", shape)
    return [tuple(corner[:2]) for corner in outline.coords] if hasattr(outline, "coords") else [(0.0, 0.0)]


def coupling_excess(coupling: Coupling, stands: Floats) -> float:
    """How far bases (A, 4) are from what a coupling asks for, m or rad; 0 if they obey it."""
    bases = [stands[arm] for arm in coupling.arms]
    match coupling:
        case SameHeight():
            return float(np.ptp([b[2] for b in bases]))
        case Distance(minimum=minimum, maximum=maximum):
            return _outside(dist(bases[0][:2], bases[1][:2]), Interval(minimum, maximum))
        case Direction(angle=angle):
            apart = bases[1][:2] - bases[0][:2]
            return float(np.linalg.norm(apart - np.linalg.norm(apart) * np.array([cos(angle), sin(angle)])))
        case Rail(angle=angle, point=point):
            start = np.array(point) if point is not None else bases[0][:2]
            aside = [abs(np.cross([cos(angle), sin(angle), 0.0], [*(b[:2] - start), 0.0])[2]) for b in bases]
            return float(max(*aside, np.ptp([b[2] for b in bases])))
        case Mirror():
            return _mirror_excess(coupling, bases[0], bases[1])
        case Rigid():
            return _stand_excess(coupling, bases[0], bases[1])
        case _:
            raise ValueError(f"no second reading of {coupling!r}")


def _stand_excess(rigid: Rigid, first: Floats, second: Floats) -> float:
    """The second base frame in the first by matrices, against the box."""
    frames = [transform(rotation_z(base[3]), base[:3]) for base in (first, second)]
    seen = np.linalg.inv(frames[0]) @ frames[1]
    turn = float(np.arctan2(seen[1, 0], seen[0, 0]))
    off = min((_outside(turn + 2.0 * pi * k, rigid.yaw) for k in range(-3, 4)), default=0.0)
    return max(
        off, *(_outside(float(v), side) for v, side in zip(seen[:3, 3], (rigid.x, rigid.y, rigid.z), strict=True))
    )


def _mirror_excess(mirror: Mirror, first: Floats, second: Floats) -> float:
    """The first base is mirrored by a Householder matrix and compared with the second: place, height, x axis."""
    normal = np.array([-sin(mirror.angle), cos(mirror.angle)])
    flip = np.eye(2) - 2.0 * np.outer(normal, normal)
    image = np.array(mirror.point) + flip @ (first[:2] - np.array(mirror.point))
    heading = flip @ np.array([cos(first[3]), sin(first[3])])
    turned = np.array([cos(second[3]), sin(second[3])])
    off = (
        np.arccos(np.clip(heading @ turned, -1.0, 1.0)) if heading @ turned < 0.9 else np.linalg.norm(heading - turned)
    )
    return float(max(np.linalg.norm(image - second[:2]), abs(first[2] - second[2]), off))
