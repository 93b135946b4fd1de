"""Second-order bounds: the linearised problem of each box, set up from the expansion of its joints.

Which multiple of 2π a joint is on has to be the same for the whole box and known: the joint's path must be linked from
pose to pose, and no other turn may be cheaper anywhere in the box. Joints for which this cannot be shown, and poses
near a singular posture, whose expansion says nothing, enter with the cost their intervals cannot avoid.

In a task sequence all this is asked of each segment by itself, except for joint 1: the yaw is common to all segments,
so it is linearised on the turns that are best together, and other turns are bounded from below (`common_shift`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.optimizer.certificate.bounds.angles.expansion import Enclosed, Expansion
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.linear import Linear
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.certificate.bounds.together import JOINTS
from duocell.optimizer.certificate.bounds.turns import FirstOrder, choose_turns, per_pose
from duocell.optimizer.certificate.bounds.yaw import unwrapped

REFINED = 16
"""Boxes of a batch, the most promising ones, whose minimiser is pulled inside the limits."""


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


@dataclass(frozen=True, eq=False, slots=True)
class Linearised:
    """The linearised problems of N boxes, and what is not in them.

    Attributes:
        linear: joints times poses, in the V variables base position [m] relative to the centre and shift of joint 1.
        start: (N, V) where to start from. constant: (N,) cost of what is not in it. others: (N,) that of other turns.
        turned: (N,) True where every yaw that a base may take is a shift of joint 1 within the variables' ends.
    """

    linear: Linear
    start: Floats
    constant: Floats
    others: Floats
    turned: Bools

    def __getitem__(self, rows: Ints) -> Linearised:
        names = "start", "constant", "others", "turned"
        return Linearised(self.linear[rows], **{name: getattr(self, name)[rows] for name in names})


def tangent_bounds(rules: Rules, half: Floats, found: Enclosed, expansion: Expansion, costs: FirstOrder) -> Tangent:
    """Lower bounds of E.

    Args:
        rules: limits and objective.
        half: (N, K) m, half sides of the boxes along the directions of the slopes.
        found: enclosed joint values. expansion: their second-order expansion.
        costs: first-order bounds, for the joints that cannot be linearised.
    """
    problem = linearised(rules, half, found, expansion, costs)
    linear, constant = problem.linear, problem.constant
    y, bound = linear.solve(problem.start)
    lower = np.minimum(np.maximum(bound, 0.0) + constant, problem.others)
    expected = np.sum(linear.weights * linear.line(y) ** 2, axis=1) + constant
    best = np.argsort(expected)[:REFINED]
    y[best] = linear[best].inside(y[best])
    return Tangent(lower, y[:, :-1], expected)


def linearised(rules: Rules, half: Floats, found: Enclosed, expansion: Expansion, costs: FirstOrder) -> Linearised:
    """Set up the linearised problems of boxes; arguments as for `tangent_bounds`."""
    values, linked = unwrapped(found.values, rules.max_step, rules.joined)
    exact = found.exact + (values.centre - found.values.centre)
    turns = choose_turns(rules, values, linked[0], exact, costs)
    _, dims, n, m = expansion.slopes.shape
    offset = per_pose(turns.shift, rules) - rules.reference[:, None, None]
    alone = per_pose(turns.alone, rules)
    limits = np.stack(
        [
            np.where(alone, (end - rules.reference)[:, None, None], open_end)
            for end, open_end in ((rules.lower, -np.inf), (rules.upper, np.inf))
        ]
    )
    used = turns.certain & np.stack(
        [np.all(linked[..., _inner(segment)], axis=-1) for segment in rules.segments], axis=-1
    )
    fine = per_pose(used, rules) & found.regular & (expansion.rest < values.radius)
    if costs.together is not None:
        fine[1:] &= ~costs.together.near
    count = rules.weights[:, None, None] if rules.counts is None else rules.weights[:, None, None] * rules.counts
    unavoidable = _distance(values + offset, limits) ** 2 * count
    unavoidable[0] = 0.0
    left = np.where(fine, 0.0, unavoidable)
    apart = np.where(
        used, np.stack([np.sum(left[..., segment], axis=-1) for segment in rules.segments], axis=-1), costs.joints
    )
    constant = np.sum(np.sum(apart, axis=-1), axis=0)
    if costs.together is None:
        constant += np.sum(np.where(used[3] | used[5], 0.0, costs.twist), axis=-1)
    else:
        terms = np.where(per_pose(used, rules), left, costs.together.each)
        more = costs.together.sums(terms, rules) - np.sum(apart[list(JOINTS)], axis=0)
        constant += np.sum(np.maximum(more, 0.0), axis=-1)

    slopes = np.zeros((6, n, m, dims + 1))
    slopes[..., :dims] = np.moveaxis(expansion.slopes, 1, -1)
    slopes[0, ..., dims] = 1.0
    limits = np.where(fine, limits, np.array([-np.inf, np.inf])[:, None, None, None])
    error, rest, weights = exact + offset, expansion.rest, count * fine
    spread = values.radius[..., 1:] + values.radius[..., :-1]
    if np.any((np.abs(np.diff(values.centre, axis=-1)) + spread > rules.max_step) & rules.joined):
        pair = _largest_step(exact, rules.joined)  # some step may be too large
        error = np.concatenate([error, _picked(error, pair + 1) - _picked(error, pair)], axis=-1)
        rise = [np.take_along_axis(slopes, (pair + k)[..., None], axis=2) for k in (0, 1)]
        slopes = np.concatenate([slopes, rise[1] - rise[0]], axis=2)
        rest = np.concatenate([rest, _picked(rest, pair) + _picked(rest, pair + 1)], axis=-1)
        weights = np.concatenate([weights, np.zeros((6, n, 1))], axis=-1)
        known = _picked(fine, pair) & _picked(fine, pair + 1)
        steps = np.where(known & rules.stepped[:, None, None], rules.max_step, np.inf)
        limits = np.concatenate([limits, np.stack([-steps, steps])], axis=-1)
    linear = Linear(
        error=_rows(error),
        slopes=slopes.swapaxes(0, 1).reshape(n, -1, dims + 1),
        rest=_rows(rest),
        weights=_rows(weights),
        limits=_rows(limits),
        low=np.column_stack([-half, turns.low]),
        high=np.column_stack([half, turns.high]),
    )
    turned = used[0, :, 0] & (turns.alone[0, :, 0] | rules.shifts.free) & (len(rules.segments) == 1)
    start = np.column_stack([np.zeros((n, dims)), turns.best])
    return Linearised(linear, start, constant, turns.others, turned)


def _rows(array: Floats) -> Floats:
    """(..., 6, N, k) as (..., N, 6 k)."""
    moved = np.moveaxis(array, -3, -2)
    return moved.reshape(*moved.shape[:-2], -1)


def _inner(segment: slice) -> slice:
    """The steps within a segment."""
    return slice(segment.start, segment.stop - 1)


def _largest_step(path: Floats, joined: Bools) -> Ints:
    """(6, N, 1) the pose before each joint's largest step within a segment."""
    pose: Ints = np.argmax(np.where(joined, np.abs(np.diff(path, axis=-1)), -1.0), axis=-1, keepdims=True)
    return pose


def _picked(array: Any, pose: Ints) -> Any:
    """The entries of (6, N, m) at ``pose`` (6, N, 1)."""
    return np.take_along_axis(array, pose, axis=-1)


def _distance(values: Ball, limits: Floats) -> Floats:
    """Distance from 0 of the part of ``values`` within the limits (2, ...)."""
    low, high = np.maximum(values.low, limits[0]), np.minimum(values.high, limits[1])
    distance: Floats = np.maximum(np.maximum(low, -high), 0.0)
    return distance
