r"""Joint 1 in a task sequence: one yaw for all segments, a turn of 2π for each of them.

Where the values of every segment are known to lie on one turn, joint 1 of segment b is shifted by ``s_b = y + 2π k_b``
with the same y for all. By the triangle inequality over all poses together (docs/method.md,
section 7.7)

    Σ_bj (c_bj + t_bj + s_b - q*)² >= (max(0, √(V + Q(y, k)) - ‖r‖))²,     Q = Σ_b W_b (s_b - s*_b)²,

V being the spread of each segment about its own mean and s*_b = q* less that mean.
`duocell.optimizer.reduction.common_yaw` gives the least Q over all y and k, and over all those with other turns than
given ones: a bound that linearises joint 1 on the best turns holds for these alone and has to be compared with what
the others cost at least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.reduction.common_yaw import SegmentShifts
from duocell.optimizer.reduction.paths import mean


@dataclass(frozen=True, eq=False, slots=True)
class CommonShift:
    """Joint 1 over N boxes, at the best turns for the centre of each.

    Attributes:
        shifts: (B, N) rad, s_b at the centre. yaw_shift: (N,) rad, y there.
        low: (N,) rad, smallest y that these turns and the limits allow. high: (N,) likewise the largest.
        others: (N,) weighted cost of joint 1 at least on other turns; -inf where there is no best one to compare with.
    """

    shifts: Floats
    yaw_shift: Floats
    low: Floats
    high: Floats
    others: Floats


def common_cost(values: Ball, rules: Rules) -> Floats:
    """(N,) weighted cost of joint 1 at least; inf where no yaw suits every segment.

    Args:
        values: (N, m) rad, joint 1 at yaw 0, every segment on one turn.
        rules: of the arm.
    """
    return _least(values, rules, _shifts(values, rules, np.asarray(rules.shifts.start)).best().cost)


def common_shift(values: Ball, rules: Rules) -> CommonShift:
    """The best turns and what others cost; arguments as for `common_cost`."""
    best = (segments := _shifts(values, rules, np.asarray(rules.shifts.start))).best()
    if rules.shifts.free:  # any turn of y will do: one about the best
        segments = _shifts(values, rules, best.yaw_shift - np.pi)
        best = segments.best()
    others = np.full(best.cost.shape, np.inf)
    for b in range(len(rules.segments)):
        for side in (-1.0, 1.0):
            least, most = np.full(best.turns.shape, -np.inf), np.full(best.turns.shape, np.inf)
            (least if side > 0.0 else most)[b] = best.turns[b] + side
            others = np.minimum(others, segments.best(least, most).cost)
    start = np.broadcast_to(segments.start, best.cost.shape)
    low = np.maximum(start, np.max(segments.low - TURN * best.turns, axis=0))
    high = np.minimum(start + segments.width, np.min(segments.high - TURN * best.turns, axis=0))
    fine = np.isfinite(best.cost) & (low <= high)
    y = np.where(fine, np.clip(best.yaw_shift, low, np.maximum(low, high)), 0.0)
    return CommonShift(
        shifts=y + TURN * best.turns,
        yaw_shift=y,
        low=np.where(fine, low, 0.0),
        high=np.where(fine, high, 0.0),
        others=np.where(fine, _least(values, rules, others), -np.inf),
    )


def _shifts(values: Ball, rules: Rules, start: Floats) -> SegmentShifts:
    """What each segment asks of joint 1, over all members of the values."""
    segments, shares = rules.segments, [rules.share(segment) for segment in rules.segments]
    low, high, reference = rules.lower[0], rules.upper[0], rules.reference[0]
    pairs = list(zip(segments, shares, strict=True))
    return SegmentShifts(
        wanted=np.array([reference - mean(values.centre[:, segment], share) for segment, share in pairs]),
        weights=np.array(
            [segment.stop - segment.start if share is None else np.sum(share) for segment, share in pairs]
        ),
        low=np.array([low - np.min(values.high[:, segment], axis=1) for segment in segments]),
        high=np.array([high - np.max(values.low[:, segment], axis=1) for segment in segments]),
        start=start,
        width=TURN if rules.shifts.free else rules.shifts.width,
    )


def _least(values: Ball, rules: Rules, cost: Floats) -> Floats:
    """(N,) ``w_1 (max(0, √(V + Q) - ‖r‖))²`` for Q = ``cost`` (N,); inf where that is."""
    possible = np.isfinite(cost)
    spread = np.zeros(len(cost))
    for segment in rules.segments:
        share = rules.share(segment)
        off = (values.centre[:, segment] - mean(values.centre[:, segment], share)[:, None]) ** 2
        spread += np.sum(off if share is None else off * share, axis=1)
    radii = values.radius**2 if rules.counts is None else values.radius**2 * rules.counts
    error = np.maximum(np.sqrt(spread + np.where(possible, cost, 0.0)) - np.sqrt(np.sum(radii, axis=1)), 0.0)
    return np.where(possible, rules.weights[0] * error**2, np.inf)
