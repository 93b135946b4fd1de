"""Couplings as linear rows in the places and yaws of two bases, for the linearised problem of a pair of boxes."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, SameHeight
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE

STEEP = 10.0
"""What a row in metres is multiplied by: a millimetre that is missing shall be felt like a hundredth of a radian."""
NEAR = 1.5
"""A distance between two boxes is expanded where it is more than so many times what it may change by."""
Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False, slots=True)
class Tie:
    """One row ``value + first · d_1 + second · d_2 + turns · (s_1, s_2) + δ`` between limits, for P pairs of boxes.

    Attributes:
        value: (P,) at the centres. first: (P, 3) slopes by the place of the one base. second: by that of the other.
        rest: (P,) |δ|. low: (P,) lower limit, or -inf. high: (P,) upper limit, or inf.
        turns: slopes by the shifts of both joints 1; (0, 0) for rows of places alone.
    """

    value: Floats
    first: Floats
    second: Floats
    rest: Floats
    low: Floats
    high: Floats
    turns: tuple[float, float] = (0.0, 0.0)


def ties(couplings: tuple[Coupling, ...], arms: tuple[int, int], first: Boxes, second: Boxes) -> list[Tie]:
    """The rows that couplings of both arms have for places; arguments as for `couplings.untied`."""
    rows = []
    for coupling in couplings:
        if set(arms) <= set(coupling.arms):
            rows += _rows(coupling, first, second)
        if isinstance(coupling, Rail) and coupling.point is not None:
            across = _level(coupling.angle + 0.5 * np.pi)
            at = float(across[:2] @ np.array(coupling.point))
            if arms[0] in coupling.arms:
                rows.append(_equal(first.centre @ across - at, across, 0.0 * across))
            if arms[1] in coupling.arms:
                rows.append(_equal(second.centre @ across - at, 0.0 * across, across))
    return rows


def mirrored_yaws(couplings: tuple[Coupling, ...], arms: tuple[int, int]) -> list[float]:
    """rad, what the sum of both yaws is modulo 2π, for every mirror that holds for both arms."""
    return [2.0 * each.angle for each in couplings if isinstance(each, Mirror) and set(arms) <= set(each.arms)]


def yaw_tie(total: Floats, known: Bools, sigma: tuple[int, int]) -> Tie:
    """The row of mirrored yaws.

    Args:
        total: (P,) rad, sum of the yaws. known: (P,) False where there shall be no row.
        sigma: senses of both joints 1: a shift s of it is the yaw -σ s.
    """
    none = np.zeros((len(total), 3))
    limit = np.where(known, TOLERANCE, np.inf)
    slopes = -float(sigma[0]), -float(sigma[1])
    return Tie(-total, none, none, np.zeros(len(total)), -limit, limit, slopes)


def _rows(coupling: Coupling, first: Boxes, second: Boxes) -> list[Tie]:
    apart = second.centre - first.centre
    match coupling:
        case SameHeight():
            return [_equal(apart @ Z, -Z, Z)]
        case Rail(angle=angle):
            across = _level(angle + 0.5 * np.pi)
            return [_equal(apart @ Z, -Z, Z), _equal(apart @ across, -across, across)]
        case Direction(angle=angle):
            across = _level(angle + 0.5 * np.pi)
            return [_equal(apart @ across, -across, across)]
        case Mirror(point=point, angle=angle):
            along, across = _level(angle), _level(angle + 0.5 * np.pi)
            sums = (first.centre + second.centre - 2.0 * np.array([*point, 0.0])) @ across
            return [_equal(apart @ Z, -Z, Z), _equal(apart @ along, -along, along), _equal(sums, across, across)]
        case Distance(minimum=minimum, maximum=maximum):
            return [_between(apart, first, second, minimum, maximum)]
        case _:
            return []


def _level(angle: float) -> Floats:
    """(3,) a level direction."""
    return np.array([cos(angle), sin(angle), 0.0])


def _equal(value: Floats, first: Floats, second: Floats) -> Tie:
    """A row (P,) [m] that has to be 0, with slopes (3,)."""
    shape, limit = (len(value), 3), np.full(len(value), STEEP * TOLERANCE)
    slopes = np.broadcast_to(STEEP * first, shape), np.broadcast_to(STEEP * second, shape)
    return Tie(STEEP * value, *slopes, np.zeros(len(value)), -limit, limit)


def _between(apart: Floats, first: Boxes, second: Boxes, minimum: float, maximum: float) -> Tie:
    """The level distance of two bases: to first order; what is left out is |d|²/2 over the smallest distance."""
    size = np.linalg.norm(apart[:, :2], axis=1)
    moved = np.linalg.norm((first.half + second.half)[:, :2], axis=1)
    known = size > NEAR * moved
    size = np.where(known, size, 1.0)
    slope = STEEP * np.column_stack([apart[:, :2] / size[:, None], np.zeros(len(size))])
    rest = np.where(known, 0.5 * STEEP * moved**2 / np.where(known, size - moved, 1.0), 0.0)
    low = np.where(known, STEEP * (minimum - TOLERANCE), -np.inf)
    high = np.where(known, STEEP * (maximum + TOLERANCE), np.inf)
    return Tie(STEEP * size, -slope, slope, rest, low, high)
