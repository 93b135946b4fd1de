"""Linear limits over boxes of base positions: where a sum of joints cannot be within its range, no path is.

A joint is enclosed modulo 2π. Within its own limits it lies between the lowest and the highest of its turns there; what
the sum of such intervals cannot reach, no choice of turns can, so no turn has to be chosen. Joint 1 is shifted by a yaw
that is not known here: it may be anywhere within its limits.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.robot.arm import TURN
from duocell.models.robot.linear_limits import LinearLimits
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.rules import MISSED, Rules


def sums_lost(limits: LinearLimits, rules: Rules, values: Ball) -> Bools:
    """(N, m) True where some limit is kept nowhere in a box.

    Args:
        limits: of the arm. rules: limits of its joints.
        values: (6, N, m) rad, its joints at yaw 0, modulo 2π.
    """
    low, high = _within_limits(rules, values)
    lost: Bools = np.zeros(values.centre.shape[1:], dtype=np.bool_)
    for row, lower, upper in zip(limits.matrix, limits.lower, limits.upper, strict=True):
        used = np.flatnonzero(row)
        ends = row[used, None, None] * low[used], row[used, None, None] * high[used]
        slack = MISSED * (1.0 + float(np.sum(np.abs(row))))
        least, most = np.sum(np.minimum(*ends), axis=0), np.sum(np.maximum(*ends), axis=0)
        lost |= (least > upper + slack) | (most < lower - slack)
    return lost


def _within_limits(rules: Rules, values: Ball) -> tuple[Floats, Floats]:
    """(6, N, m) rad, least and largest value of every joint within its limits, on any turn.

    Where no turn brings a joint inside, that excludes the box already: its limits are as good as anything.
    """
    lower, upper = (np.broadcast_to(side[:, None, None], values.centre.shape) for side in (rules.lower, rules.upper))
    first, last = np.ceil((lower - values.high) / TURN), np.floor((upper - values.low) / TURN)
    known = first <= last
    known[0] = False
    with np.errstate(invalid="ignore"):  # joints without end
        low = np.where(known, np.maximum(lower, values.low + TURN * first), lower)
        high = np.where(known, np.minimum(upper, values.high + TURN * last), upper)
    return low, high
