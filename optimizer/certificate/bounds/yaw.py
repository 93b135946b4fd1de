r"""Joint 1 of a base that may be turned: the cost that no yaw can avoid.

A yaw shifts all of q1 by the same s (up to 2πk), so over a stretch of poses whose values c_j ± r_j are on one turn the
cost is at least ``(max(0, ‖c + s - q*‖ - ‖r‖))²``, a parabola in s about ``s* = q* - c̄`` (docs/method.md, section 7.7).
A free yaw leaves its least value; a bounded one, or limits of joint 1, keep s at a distance from s*.

Values of neighbouring poses are on one turn if only one winding of the later one can be within the largest step of the
earlier one. The mean over poses of which that is not known would be unsound: then the path falls into stretches, each
with a shift of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.ball import Ball


def unwrapped(values: Ball, max_step: float, joined: Bools | None = None) -> tuple[Ball, Bools]:
    """Values (..., m) continued along the path the short way round, and (..., m-1) where that is the only way.

    Between segments (where ``joined`` (m-1,) is False) it never is.
    """
    steps = np.diff(values.centre, axis=-1)
    steps = steps - TURN * np.round(steps / TURN)
    centre = np.empty_like(values.centre)
    centre[..., 0] = values.centre[..., 0]
    centre[..., 1:] = values.centre[..., :1] + np.cumsum(steps, axis=-1)
    spread = values.radius[..., 1:] + values.radius[..., :-1]
    linked = np.abs(steps) + spread < TURN - max_step
    return Ball(centre, values.radius), linked if joined is None else linked & joined


@dataclass(frozen=True, eq=False, slots=True)
class Shifts:
    """The shifts that yaw and turns of 2π allow: ``[start, start + width] + 2πk``, or all."""

    start: float
    width: float
    free: bool

    def nearest(self, wanted: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """Nearest allowed shift to ``wanted`` in [low, high], and its distance: inf where there is none."""
        inside = np.clip(wanted, low, high)
        distance = np.where(low <= high, np.abs(wanted - inside), np.inf)
        if self.free:
            return inside, distance
        turn = np.floor((inside - self.start) / TURN)
        before = np.minimum(inside, self.start + TURN * turn + self.width)
        after = self.start + TURN * (turn + 1.0)
        down = np.where((before >= low) & (low <= high), np.abs(wanted - before), np.inf)
        up = np.where((after <= high) & (low <= high), np.abs(wanted - after), np.inf)
        return np.where(down <= up, before, after), np.minimum(down, up)


def torn(values: Ball, max_step: float, joined: Bools | None = None) -> Bools:
    """(N, m) True at poses that no winding brings within the largest step of the pose before, if that is joined
    (m-1,).
    """
    steps = np.diff(values.centre, axis=-1)
    steps = np.abs(steps - TURN * np.round(steps / TURN))
    apart = np.zeros(values.centre.shape, dtype=bool)
    apart[:, 1:] = steps - values.radius[:, 1:] - values.radius[:, :-1] > max_step
    if joined is not None:
        apart[:, 1:] &= joined
    return apart


@dataclass(frozen=True, eq=False, slots=True)
class ShiftCost:
    """Bounds for joint 1 over N boxes.

    Attributes:
        cost: (N,) lower bound of ``Σ_j (q1_j - q*)²`` over the allowed shifts; inf where none is allowed.
        outside: (N, m) True where no allowed shift brings the pose inside the limits.
    """

    cost: Floats
    outside: Bools


def shift_cost(
    values: Ball,
    linked: Bools,
    lower: float,
    upper: float,
    reference: float,
    shifts: Shifts,
    counts: Floats | None = None,
) -> ShiftCost:
    """Bound the cost of joint 1.

    Args:
        values: (N, m) rad, continued along the path. linked: (N, m-1) from `unwrapped`.
        lower: rad, limit of joint 1. upper: likewise.
        reference: rad, q*.
        shifts: what yaw allows.
        counts: (m,) what the poses count for; None for 1.
    """
    n, m = values.centre.shape
    starts = np.ones((n, m), dtype=bool)
    starts[:, 1:] = ~linked
    stretch = np.cumsum(starts.ravel()) - 1

    def added(rows: Floats) -> Floats:
        """The sum of (N, m) over each stretch."""
        return np.asarray(np.bincount(stretch, (rows if counts is None else rows * counts).ravel()), dtype=np.float64)

    lengths = added(np.ones((n, m)))
    divisor = np.maximum(lengths, 1e-300)  # what counts for nothing may have any mean
    centre = values.centre - np.mean(values.centre, axis=1, keepdims=True)
    means = added(centre) / divisor
    about = added((centre - means[stretch].reshape(n, m)) ** 2)
    radii = np.sqrt(added(values.radius**2))
    first = np.flatnonzero(starts.ravel())
    least, most = lower - values.high, upper - values.low
    low, high = np.maximum.reduceat(least.ravel(), first), np.minimum.reduceat(most.ravel(), first)
    middle = added(values.centre) / divisor
    _, away = shifts.nearest(reference - middle, low, high)
    never = np.isinf(away)
    cost = np.maximum(np.sqrt(about + lengths * np.where(never, 0.0, away) ** 2) - radii, 0.0) ** 2
    cost[never] = np.inf
    total = np.bincount(first // m, cost, minlength=n).astype(np.float64)
    return ShiftCost(total, np.isinf(shifts.nearest(np.zeros_like(least), least, most)[1]))
