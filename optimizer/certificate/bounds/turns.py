"""Which multiple of 2π each joint of each segment is on in a box, as far as that is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.common_shift import common_shift
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.certificate.bounds.together import Together
from duocell.optimizer.certificate.bounds.yaw import Shifts
from duocell.optimizer.reduction.paths import mean

_TURNS = Shifts(start=0.0, width=0.0, free=False)
"""All that can shift joints 2 to 6: multiples of 2π."""


@dataclass(frozen=True, eq=False, slots=True)
class FirstOrder:
    """What the intervals of joint values cost at least, over N boxes.

    Attributes:
        joints: (6, N, B) weighted cost of each joint in each segment; all of joint 1 is in the first one.
        twist: (N, B) what joints 4 and 6 (for three parallel axes also 2 and 3) cost more together than one by one.
        together: the same pose by pose for three parallel axes; None where it says nothing.
    """

    joints: Floats
    twist: Floats
    together: Together | None = None

    def __getitem__(self, rows: Bools) -> FirstOrder:
        together = None if self.together is None else self.together[rows]
        return FirstOrder(self.joints[:, rows], self.twist[rows], together)

    @property
    def total(self) -> Floats:
        """(N,) lower bound of E."""
        total: Floats = np.sum(np.sum(self.joints, axis=-1), axis=0) + np.sum(self.twist, axis=-1)
        return total


@dataclass(frozen=True, eq=False, slots=True)
class Turns:
    """The turns on which the joints of N boxes are linearised.

    Attributes:
        shift: (6, N, B) rad, multiples of 2π added to each joint in each segment; 0 for joint 1 of a single segment.
        certain: (6, N, B) True where no other turn can be cheaper anywhere in the box, or ``others`` bounds it.
        alone: (6, N, B) True where the limits may be used as constraints on this turn.
        low: (N,) rad, smallest shift of joint 1. high: (N,) largest. best: (N,) the best at the centre of the box.
        others: (N,) lower bound of E on other turns of joint 1 that ``certain`` does not rule out.
    """

    shift: Floats
    certain: Bools
    alone: Bools
    low: Floats
    high: Floats
    best: Floats
    others: Floats


def choose_turns(rules: Rules, values: Ball, linked: Bools, exact: Floats, costs: FirstOrder) -> Turns:
    """Choose the turns.

    Args:
        rules: limits and objective.
        values: (6, N, m) rad, continued along the path. exact: (6, N, m) rad, at the centres of the boxes.
        linked: (N, m - 1) True where that is the only way to continue joint 1.
        costs: first-order bounds.
    """
    _, n, _ = exact.shape
    shape = (6, n, len(rules.segments))
    shift, certain, alone = np.zeros(shape), np.ones(shape, dtype=bool), np.ones(shape, dtype=bool)
    for i in range(1, 6):
        joint = rules.lower[i], rules.upper[i], rules.reference[i]
        for b, segment in enumerate(rules.segments):
            turn = _choose(values[i, :, segment], *joint, _TURNS, rules.share(segment))
            shift[i, :, b], certain[i, :, b], alone[i, :, b] = turn.best, turn.certain, turn.alone
    if len(rules.segments) == 1:
        joint = rules.lower[0], rules.upper[0], rules.reference[0]
        turn = _choose(values[0], *joint, rules.shifts, rules.counts)
        certain[0, :, 0], alone[0, :, 0] = turn.certain, turn.alone
        return Turns(shift, certain, alone, turn.low, turn.high, turn.best, np.full(n, np.inf))
    common = common_shift(values[0], rules)
    shift[0] = (common.shifts - common.yaw_shift).T
    known = np.all(linked | ~rules.joined, axis=-1)
    others = np.sum(costs.joints[1:], axis=(0, 2)) + np.sum(costs.twist, axis=-1) + common.others
    error = exact + per_pose(shift, rules) - rules.reference[:, None, None]
    error[0] += common.yaw_shift[:, None]
    squares = error**2 if rules.counts is None else error**2 * rules.counts
    centre = np.einsum("i,inm->n", rules.weights, squares)
    certain[0] = (known & (others >= centre))[:, None]  # else the interval of joint 1 is the better bound
    others = np.where(certain[0, :, 0], others, np.inf)
    return Turns(shift, certain, alone, common.low, common.high, common.yaw_shift, others)


def per_pose(array: Any, rules: Rules) -> Any:
    """(..., B), one entry per segment, as (..., m); as it is where there is only one segment."""
    lengths = [segment.stop - segment.start for segment in rules.segments]
    return array if len(lengths) == 1 else np.repeat(array, lengths, axis=-1)


@dataclass(frozen=True, eq=False, slots=True)
class _Turn:
    """The stretch of shifts [low, high] that holds the best one; all (N,).

    Attributes:
        best: the best shift at the centre of the box.
        certain: no other stretch can be cheaper anywhere in the box.
        alone: no other stretch is possible, so the limits may be used as constraints on this one.
    """

    low: Floats
    high: Floats
    best: Floats
    certain: Bools
    alone: Bools


def _choose(values: Ball, lower: float, upper: float, reference: float, shifts: Shifts, counts: Floats | None) -> _Turn:
    """Choose among the stretches ``[start, start + width] + 2πk`` that leave every pose a chance to keep its limits.

    Shifted by s, the path costs ``m (s - s*)²`` plus what does not depend on s, with s* = q* - mean of q.
    """
    least = lower - np.min(values.high, axis=-1)
    most = upper - np.max(values.low, axis=-1)
    wanted = reference - mean(values.centre, counts)
    doubt = mean(values.radius, counts)
    if shifts.free:
        low = np.where(np.isfinite(least), least, wanted - doubt)
        high = np.where(np.isfinite(most), most, wanted + doubt)
        always = np.ones(wanted.shape, dtype=bool)
        return _Turn(low, high, np.clip(wanted, low, high), always, always)
    best, _ = shifts.nearest(wanted, least, most)
    half = 0.5 * shifts.width
    middle = shifts.start + half
    turn = np.round((best - middle) / TURN)
    centre = middle + TURN * turn
    first, last = np.ceil((least - middle - half) / TURN), np.floor((most - middle + half) / TURN)
    # Stretches 2π apart are equally near halfway between their middles.
    certain = (turn >= last) | (wanted + doubt <= centre + np.pi)
    certain &= (turn <= first) | (wanted - doubt >= centre - np.pi)
    alone = first == last
    low = np.where(alone, np.maximum(centre - half, least), centre - half)
    high = np.where(alone, np.minimum(centre + half, most), centre + half)
    return _Turn(low, high, np.clip(best, low, high), certain, alone)
