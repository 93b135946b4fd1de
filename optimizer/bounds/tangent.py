"""Second-order bounds: the linearised problem of each box, set up from the expansion of its joints.

Which multiple of 2π a joint is on has to be the same for the whole box and known: the joint's path must be linked from
pose to pose, and no other turn may be cheaper anywhere in the box. Joints for which this cannot be shown, and poses
near a singular posture, whose expansion says nothing, enter with the cost their intervals cannot avoid.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from models.arm import TURN
from models.arrays import Bools, Floats, Ints
from optimizer.bounds.ball import Ball
from optimizer.bounds.expansion import Enclosed, Expansion
from optimizer.bounds.linear import Linear
from optimizer.bounds.rules import Rules
from optimizer.bounds.yaw import Shifts, unwrapped

REFINED = 16
"""Boxes of a batch, the most promising ones, whose minimiser is pulled inside the limits."""

_TURNS = Shifts(start=0.0, width=0.0, free=False)
"""All that can shift joints 2 to 6: multiples of 2π."""


@dataclass(frozen=True, eq=False, slots=True)
class FirstOrder:
    """What the intervals of joint values cost at least, over N boxes.

    Attributes:
        joints: (6, N) weighted cost of each joint.
        twist: (N,) what joints 4 and 6 cost more together than one by one.
    """

    joints: Floats
    twist: Floats

    def __getitem__(self, rows: Bools) -> FirstOrder:
        return FirstOrder(self.joints[:, rows], self.twist[rows])

    @property
    def total(self) -> Floats:
        """(N,) lower bound of E."""
        total: Floats = np.sum(self.joints, axis=0) + self.twist
        return total


@dataclass(frozen=True, eq=False, slots=True)
class Tangent:
    """What the linearised problem says of N boxes.

    Attributes:
        lower: (N,) lower bound of E.
        step: (N, K) m, from the centre to where the cost is probably smallest. expected: (N,) about the cost there.
    """

    lower: Floats
    step: Floats
    expected: Floats


def tangent_bounds(rules: Rules, half: Floats, found: Enclosed, expansion: Expansion, costs: FirstOrder) -> Tangent:
    """Lower bounds of E.

    Args:
        rules: limits and objective.
        half: (N, K) m, half sides of the boxes along the directions of the slopes.
        found: enclosed joint values. expansion: their second-order expansion.
        costs: first-order bounds, for the joints that cannot be linearised.
    """
    linear, start, constant = _linearised(rules, half, found, expansion, costs)
    y, bound = linear.solve(start)
    lower = np.maximum(bound, 0.0) + constant
    expected = np.sum(linear.weights * linear.line(y) ** 2, axis=1) + constant
    best = np.argsort(expected)[:REFINED]
    y[best] = linear[best].inside(y[best])
    return Tangent(lower, y[:, :-1], expected)


def _linearised(
    rules: Rules, half: Floats, found: Enclosed, expansion: Expansion, costs: FirstOrder
) -> tuple[Linear, Floats, Floats]:
    """The linear problem, (N, V) where to start from, and (N,) the cost of what is not in it."""
    values, linked = unwrapped(found.values, rules.max_step)
    exact = found.exact + (values.centre - found.values.centre)
    turns = [
        _choose(values[i], rules.lower[i], rules.upper[i], rules.reference[i], rules.shifts if i == 0 else _TURNS)
        for i in range(6)
    ]
    _, dims, n, m = expansion.slopes.shape
    shift = np.stack([np.zeros(n), *(turn.best for turn in turns[1:])])  # that of joint 1 is a variable
    offset = (shift - rules.reference[:, None])[..., None]
    alone = np.stack([turn.alone for turn in turns])
    limits = np.stack(
        [
            np.where(alone, (end - rules.reference)[:, None], open_end)[..., None]
            for end, open_end in ((rules.lower, -np.inf), (rules.upper, np.inf))
        ]
    )
    used = np.all(linked, axis=-1) & np.stack([turn.certain for turn in turns])
    fine = used[..., None] & found.regular & (expansion.rest < values.radius)
    unavoidable = _distance(values + offset, limits) ** 2 * rules.weights[:, None, None]
    unavoidable[0] = 0.0
    constant = np.sum(np.where(used, np.sum(np.where(fine, 0.0, unavoidable), axis=-1), costs.joints), axis=0)
    constant += np.where(used[3] | used[5], 0.0, costs.twist)

    slopes = np.zeros((6, n, m, dims + 1))
    slopes[..., :dims] = np.moveaxis(expansion.slopes, 1, -1)
    slopes[0, ..., dims] = 1.0
    limits = np.where(fine, limits, np.array([-np.inf, np.inf])[:, None, None, None])
    error, rest, weights = exact + offset, expansion.rest, rules.weights[:, None, None] * fine
    spread = values.radius[..., 1:] + values.radius[..., :-1]
    if np.any(np.abs(np.diff(values.centre, axis=-1)) + spread > rules.max_step):  # some step may be too large
        pair = _largest_step(exact)
        error = np.concatenate([error, _picked(error, pair + 1) - _picked(error, pair)], axis=-1)
        rise = [np.take_along_axis(slopes, (pair + k)[..., None], axis=2) for k in (0, 1)]
        slopes = np.concatenate([slopes, rise[1] - rise[0]], axis=2)
        rest = np.concatenate([rest, _picked(rest, pair) + _picked(rest, pair + 1)], axis=-1)
        weights = np.concatenate([weights, np.zeros((6, n, 1))], axis=-1)
        known = _picked(fine, pair) & _picked(fine, pair + 1)
        steps = np.where(known, rules.max_step, np.inf)
        limits = np.concatenate([limits, np.stack([-steps, steps])], axis=-1)
    linear = Linear(
        error=_rows(error),
        slopes=slopes.swapaxes(0, 1).reshape(n, -1, dims + 1),
        rest=_rows(rest),
        weights=_rows(weights),
        limits=_rows(limits),
        low=np.column_stack([-half, turns[0].low]),
        high=np.column_stack([half, turns[0].high]),
    )
    return linear, np.column_stack([np.zeros((n, dims)), turns[0].best]), constant


def _rows(array: Floats) -> Floats:
    """(..., 6, N, k) as (..., N, 6 k)."""
    moved = np.moveaxis(array, -3, -2)
    return moved.reshape(*moved.shape[:-2], -1)


def _largest_step(path: Floats) -> Ints:
    """(6, N, 1) the pose before each joint's largest step."""
    pose: Ints = np.argmax(np.abs(np.diff(path, axis=-1)), axis=-1, keepdims=True)
    return pose


def _picked(array: Any, pose: Ints) -> Any:
    """The entries of (6, N, m) at ``pose`` (6, N, 1)."""
    return np.take_along_axis(array, pose, axis=-1)


def _distance(values: Ball, limits: Floats) -> Floats:
    """Distance from 0 of the part of ``values`` within the limits (2, ...)."""
    low, high = np.maximum(values.low, limits[0]), np.minimum(values.high, limits[1])
    distance: Floats = np.maximum(np.maximum(low, -high), 0.0)
    return distance


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


def _choose(values: Ball, lower: float, upper: float, reference: float, shifts: Shifts) -> _Turn:
    """Choose among the stretches ``[start, start + width] + 2πk`` that leave every pose a chance to keep its limits.

    Shifted by s, the path costs ``m (s - s*)²`` plus what does not depend on s, with s* = q* - mean of q.
    """
    least = lower - np.min(values.high, axis=-1)
    most = upper - np.max(values.low, axis=-1)
    wanted = reference - np.mean(values.centre, axis=-1)
    doubt = np.mean(values.radius, axis=-1)
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
