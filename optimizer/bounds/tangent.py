"""Second-order bounds: the linearised problem of each box, set up from the expansion of its joints.

Which multiple of 2π a joint is on has to be the same for the whole box and known: the joint's path must be linked from
pose to pose, and no other turn may be cheaper anywhere in the box. Joints for which this cannot be shown, and poses
near a singular posture, whose expansion says nothing, enter with the cost their intervals cannot avoid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arm import TURN, Arm
from models.arrays import Bools, Floats
from optimizer.bounds.ball import Ball
from optimizer.bounds.expansion import Enclosed, Expansion
from optimizer.bounds.joints import SLACK
from optimizer.bounds.linear import Linear
from optimizer.bounds.yaw import Shifts, unwrapped


def tangent_bounds(
    arm: Arm, max_step: float, shifts: Shifts, found: Enclosed, expansion: Expansion, costs: Floats
) -> tuple[Floats, Floats]:
    """Lower bounds of E.

    Args:
        arm: weights, reference and limits.
        max_step: rad.
        shifts: what yaw allows joint 1.
        found: enclosed joint values. expansion: their second-order expansion.
        costs: (6, N) weighted first-order bounds, for the joints that cannot be linearised.

    Returns:
        (N,) bounds, and (N, K) where in the box, relative to its centre, the cost is probably smallest.
    """
    linear, start, constant = _linearised(arm, max_step, shifts, found, expansion, costs)
    y = linear.minimiser(start)
    return np.maximum(linear.dual_value(y), 0.0) + constant, linear.inside(y)[:, :-1]


def _linearised(
    arm: Arm, max_step: float, shifts: Shifts, found: Enclosed, expansion: Expansion, costs: Floats
) -> tuple[Linear, Floats, Floats]:
    """The linear problem, (N, V) where to start from, and (N,) the cost of what is not in it."""
    values, linked = unwrapped(found.values, max_step)
    exact = found.exact + (values.centre - found.values.centre)
    turns = [
        _choose(values[i], arm.lower[i], arm.upper[i], arm.reference[i], shifts if i == 0 else Shifts(0.0, 0.0, False))
        for i in range(6)
    ]
    _, dims, n, m = expansion.slopes.shape
    shift = np.stack([np.zeros(n), *(turn.best for turn in turns[1:])])  # that of joint 1 is a variable
    offset = (shift - arm.reference[:, None])[..., None]
    alone = np.stack([turn.alone for turn in turns])
    limits = np.stack(
        [np.where(alone, (end - arm.reference)[:, None], open_end)[..., None]
        for end, open_end in ((arm.lower - SLACK, -np.inf), (arm.upper + SLACK, np.inf))]
    )
    used = np.all(linked, axis=-1) & np.stack([turn.certain for turn in turns])
    fine = used[..., None] & found.regular & (expansion.rest < values.radius)
    unavoidable = _distance(values + offset, limits) ** 2 * arm.weights[:, None, None]
    unavoidable[0] = 0.0
    constant = np.sum(np.where(used, np.sum(np.where(fine, 0.0, unavoidable), axis=-1), costs), axis=0)

    def rows(array: Floats) -> Floats:
        """(..., 6, N, m) as (..., N, 6 m)."""
        moved = np.moveaxis(array, -3, -2)
        return moved.reshape(*moved.shape[:-2], 6 * m)

    slopes = np.empty((n, 6, m, dims + 1))
    slopes[..., :dims] = expansion.slopes.transpose(2, 0, 3, 1)
    slopes[..., dims] = 0.0
    slopes[:, 0, :, dims] = 1.0
    half = found.boxes.half[:, :dims]
    linear = Linear(
        error=rows(exact + offset),
        slopes=slopes.reshape(n, 6 * m, dims + 1),
        rest=rows(expansion.rest),
        weights=rows(arm.weights[:, None, None] * fine),
        limits=rows(np.where(fine, limits, np.array([-np.inf, np.inf])[:, None, None, None])),
        low=np.column_stack([-half, turns[0].low]),
        high=np.column_stack([half, turns[0].high]),
    )
    return linear, np.column_stack([np.zeros((n, dims)), turns[0].best]), constant


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
    """Choose among the stretches ``[start, start + width] + 2πk`` that leave every pose a chance to be inside its limits.

    Shifted by s, the path costs ``m (s - s*)²`` plus what does not depend on s, with s* = q* - mean of q.
    """
    least = lower - SLACK - np.min(values.high, axis=-1)
    most = upper + SLACK - np.max(values.low, axis=-1)
    wanted = reference - np.mean(values.centre, axis=-1)
    doubt = np.mean(values.radius, axis=-1)
    if shifts.free:
        limited = np.isfinite(least), np.isfinite(most)
        low, high = np.where(limited[0], least, wanted - doubt), np.where(limited[1], most, wanted + doubt)
        # With one limit only, the best shift may lie beyond both s* and what the box's enclosure tells of the limit.
        return _Turn(low, high, np.clip(wanted, low, high), limited[0] == limited[1], np.ones_like(limited[0]))
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
