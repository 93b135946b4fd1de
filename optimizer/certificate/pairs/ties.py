"""Couplings as linear rows in the places and yaws of two bases, for the linearised problem of a pair of boxes."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.coupling.relations import Linear, Separation, Yaws, linear_between
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE

STEEP = 10.0
"""What a row in metres is multiplied by: a millimetre that is missing shall be felt like a hundredth of a radian."""
NEAR = 1.5
"""A distance between two boxes is expanded where it is more than so many times what it may change by."""


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
    """The rows that couplings have for the places of both arms; arguments as for `couplings.untied`.

    Rows with a limit on one side only are left out: the cheapest places seldom touch it.
    """
    rows: list[Tie] = []
    for coupling in couplings:
        relations = coupling.relations()
        two_sided = (row for row in linear_between(relations, *arms) if isfinite(row.low) and isfinite(row.high))
        rows += [_linear(row, arms, first, second) for row in two_sided]
        for relation in relations:
            if isinstance(relation, Separation) and relation.level and set(relation.arms) == set(arms):
                apart = second.centre - first.centre
                rows.append(_between(apart, first, second, relation.minimum, relation.maximum))
    return rows


def mirrored_yaws(couplings: tuple[Coupling, ...], arms: tuple[int, int]) -> list[float]:
    """rad, what the sum of both yaws is modulo 2π, for every coupling that says it for both arms."""
    return [yaws.low for yaws in tied_yaws(couplings, arms) if yaws.sense > 0 and yaws.low == yaws.high]


def tied_yaws(couplings: tuple[Coupling, ...], arms: tuple[int, int]) -> list[Yaws]:
    """What couplings say of the yaws of both arms."""
    relations = (relation for coupling in couplings for relation in coupling.relations())
    return [each for each in relations if isinstance(each, Yaws) and set(each.arms) == set(arms)]


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


def _linear(row: Linear, arms: tuple[int, int], first: Boxes, second: Boxes) -> Tie:
    """A row of one or both places (P,)."""
    slopes = {arm: STEEP * np.array(direction) for arm, direction in row.terms}
    one, other = (slopes.get(arm, np.zeros(3)) for arm in arms)
    count = len(first)
    return Tie(
        first.centre @ one + second.centre @ other,
        np.broadcast_to(one, (count, 3)),
        np.broadcast_to(other, (count, 3)),
        np.zeros(count),
        np.full(count, STEEP * (row.low - TOLERANCE)),
        np.full(count, STEEP * (row.high + TOLERANCE)),
    )


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
