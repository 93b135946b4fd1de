"""Constraints of one arm as rows ``g <= 0``, and the three penalties on them: (8.27), (8.28) and (8.25)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.segments import joined
from duocell.models.robot.arm import Arm
from duocell.optimizer.baselines.conjugate_gradients import Point
from duocell.optimizer.baselines.gradient import Followed, PostureFunction

Penalty = Callable[[Floats], tuple[float, Floats] | None]
"""From rows g to the penalty and its derivative by g; None where the penalty is not defined."""


@dataclass(frozen=True, slots=True)
class Barrier:
    """A form of the interior penalty.

    Attributes:
        penalty: from r' to the penalty.
        amount: what r' is multiplied by to bound what the barrier may hide of E at a minimum of Φ: ``Σ -1/g`` for
            (8.27), the number of rows for (8.28).
    """

    penalty: Callable[[float], Penalty]
    amount: Callable[[Floats], float]


def _inverse(parameter: float) -> Penalty:
    """(8.27): ``-r' Σ 1/g``."""

    def penalty(rows: Floats) -> tuple[float, Floats] | None:
        if not np.all(rows < 0.0):
            return None
        inverse = 1.0 / rows
        return -parameter * float(np.sum(inverse)), parameter * inverse * inverse

    return penalty


def _logarithm(parameter: float) -> Penalty:
    """(8.28): ``-r' Σ log(-g)``."""

    def penalty(rows: Floats) -> tuple[float, Floats] | None:
        if not np.all(rows < 0.0):
            return None
        return -parameter * float(np.sum(np.log(-rows))), -parameter / rows

    return penalty


INVERSE_BARRIER = Barrier(_inverse, lambda rows: float(np.sum(-1.0 / rows)))
LOG_BARRIER = Barrier(_logarithm, lambda rows: float(len(rows)))


def exterior(parameter: float, margin: float) -> Penalty:
    """(8.25): ``r Σ max(0, g)²``, on rows tightened by ``margin`` so that a finite r ends inside."""

    def penalty(rows: Floats) -> tuple[float, Floats] | None:
        over = np.maximum(rows + margin, 0.0)
        return parameter * float(np.sum(over * over)), 2.0 * parameter * over

    return penalty


@dataclass(frozen=True, eq=False, slots=True)
class _Selected:
    """Which rows exist: joints and sums of joints with limits, with their slopes; bounded components of the base."""

    limited: Ints
    slopes: Floats
    lower: Floats
    upper: Floats
    bounded: Ints
    box: Floats


class ConstrainedPosture:
    """One posture's E(Γ) with its constraints, over the free components of Γ.

    Rows, in this order: joints (and sums with linear limits) above their upper limits and below their lower ones (per
    pose, rad); joint steps beyond
    the allowed one, up and down (rad; ours, the source has none; within a segment); reach (m); base region (m, rad).
    """

    def __init__(self, function: PostureFunction) -> None:
        self.function = function
        self.free = free_components(function.problem.arm)
        self._rows = _select(function.problem.arm)
        self._before = np.flatnonzero(joined(function.problem.starts, len(function.problem.positions)))

    def rows(self, path: Followed) -> Floats:
        """(k,) all rows."""
        chosen = self._rows
        q = self.function.problem.arm.bounded(path.joints)[:, chosen.limited]
        steps = np.diff(path.joints, axis=0)[self._before]
        allowed = self.function.problem.max_step
        place = path.placement[chosen.bounded]
        return np.concatenate(
            [
                (q - chosen.upper).ravel(),
                (chosen.lower - q).ravel(),
                (steps - allowed).ravel(),
                (-steps - allowed).ravel(),
                path.reach.values.ravel(),
                place - chosen.box[:, 1],
                chosen.box[:, 0] - place,
            ]
        )

    def at(self, path: Followed, penalty: Penalty) -> Point[Followed] | None:
        """Φ and its gradient over the free components; None where Φ is not defined."""
        penalised = penalty(self.rows(path))
        if penalised is None:
            return None
        value, weights = penalised
        chosen, m = self._rows, len(path.joints)
        k, s, before = len(chosen.limited), path.joints.shape[1], self._before
        steps = len(before) * s
        sizes = np.cumsum([m * k, m * k, steps, steps, path.reach.values.size, len(chosen.bounded)])
        upper, lower, up, down, reach, high, low = np.split(weights, sizes)
        slope = self.function.objective_slope(path)
        slope += (upper - lower).reshape(m, k) @ chosen.slopes
        net = (up - down).reshape(-1, s)
        slope[before + 1] += net
        slope[before] -= net
        gradient = self.function.pull_back(path, slope)
        if gradient is None:
            return None
        gradient[:3] += np.einsum("kj,kjc->c", reach.reshape(path.reach.values.shape), path.reach.gradients)
        gradient[chosen.bounded] += high - low
        total = self.function.objective(path) + value
        return Point(path.placement[self.free], total, gradient[self.free], path) if np.isfinite(total) else None

    def step(self, free: Floats, near: Followed, penalty: Penalty) -> Point[Followed] | None:
        """Φ at new free components, the path followed from ``near``; None outside the domain."""
        placement = near.placement.copy()
        placement[self.free] = free
        path = self.function.follow(placement, near)
        return None if path is None else self.at(path, penalty)


def free_components(arm: Arm) -> Ints:
    """Indices of x, y, z, yaw that the request leaves free."""
    region = arm.base
    return np.flatnonzero([not i.fixed for i in (region.x, region.y, region.z, region.yaw)])


def _select(arm: Arm) -> _Selected:
    limited = np.flatnonzero(np.isfinite(arm.bounded_lower) & np.isfinite(arm.bounded_upper))
    bounded = np.array([i for i in free_components(arm) if i < 3 or not arm.base.yaw_free], dtype=np.int64)
    lower, upper, slopes = arm.bounded_lower[limited], arm.bounded_upper[limited], arm.bounded_slopes[limited]
    return _Selected(limited, slopes, lower, upper, bounded, arm.base.bounds[bounded])
