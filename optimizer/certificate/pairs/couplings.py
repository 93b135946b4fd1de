"""Couplings over pairs of boxes of base positions: which pairs hold no two bases that keep them all."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, SameHeight
from duocell.models.cell.coupling.apart import Apart
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE


def untied(couplings: tuple[Coupling, ...], arms: tuple[int, int], first: Boxes, second: Boxes) -> Bools:
    """(P,) True where no two bases in boxes (P,) keep a coupling.

    Args:
        couplings: of the cell; those that do not hold for both arms are passed over.
        arms: indices of the two. first: boxes of the one. second: of the other.
    """
    lost: Bools = np.zeros(len(first), dtype=np.bool_)
    for coupling in couplings:
        if set(arms) <= set(coupling.arms):
            swapped = coupling.arms.index(arms[0]) > coupling.arms.index(arms[1])
            lost |= _untied(coupling, *((second, first) if swapped else (first, second)))
        if isinstance(coupling, Rail):
            for arm, boxes in zip(arms, (first, second), strict=True):
                lost |= _off_rail(coupling, arm, boxes)
    return lost


def _off_rail(rail: Rail, arm: int, boxes: Boxes) -> Bools:
    """(P,) True where no base in a box of one arm is on the rail, if that has a place and is the arm's."""
    if rail.point is None or arm not in rail.arms:
        return np.zeros(len(boxes), dtype=np.bool_)
    across = np.array([-sin(rail.angle), cos(rail.angle)])
    level = float(across @ np.array(rail.point))
    return _away(boxes.centre[:, :2] @ across - level, boxes.half[:, :2] @ np.abs(across))


def _untied(coupling: Coupling, first: Boxes, second: Boxes) -> Bools:
    """(P,) True where two arms, in the order of a coupling, cannot keep it."""
    apart, reach = second.centre - first.centre, first.half + second.half
    level = _away(apart[:, 2], reach[:, 2])
    match coupling:
        case SameHeight():
            return level
        case Rail(angle=angle):
            return level | _away(*_across(apart, reach, angle))
        case Distance(minimum=minimum, maximum=maximum):
            size = np.abs(apart[:, :2])
            near = np.linalg.norm(np.maximum(size - reach[:, :2], 0.0), axis=1)
            far = np.linalg.norm(size + reach[:, :2], axis=1)
            return np.asarray((near > maximum + TOLERANCE) | (far < minimum - TOLERANCE))
        case Apart(least=least):
            return np.asarray(np.linalg.norm(np.abs(apart) + reach, axis=1) < least - TOLERANCE)
        case Direction(angle=angle):
            along, spread = _along(apart, reach, angle)
            return _away(*_across(apart, reach, angle)) | (along + spread < -TOLERANCE)
        case Mirror(point=point, angle=angle):
            sums = first.centre + second.centre - 2.0 * np.array([*point, 0.0])
            return level | _away(*_along(apart, reach, angle)) | _away(*_across(sums, reach, angle))
        case _:
            return np.zeros(len(first), dtype=np.bool_)


def _along(places: Floats, reach: Floats, angle: float) -> tuple[Floats, Floats]:
    """(P,) m, coordinates along a direction, and by how much they may differ."""
    direction = np.array([cos(angle), sin(angle)])
    return places[:, :2] @ direction, reach[:, :2] @ np.abs(direction)


def _across(places: Floats, reach: Floats, angle: float) -> tuple[Floats, Floats]:
    return _along(places, reach, angle + 0.5 * np.pi)


def _away(value: Floats, spread: Floats) -> Bools:
    """True where a value that may differ by ``spread`` is not 0."""
    return np.asarray(np.abs(value) > spread + TOLERANCE)
