"""The cheapest way to lift enclosed joint values by multiples of 2π along a path.

A joint is known modulo 2π and within a radius, pose by pose. A path has to choose a lift at every pose such that the
value can be inside the limits, and such that neighbouring values can be within the largest allowed step. The cost of
a pose at a lift is at least ``w · dist(q*, interval ∩ limits)²``. The cheapest chain of lifts is found by dynamic
programming along the path; where no chain exists, no path exists anywhere in the box.

Nothing is unwrapped beforehand, so nothing has to be assumed about neighbouring poses: where the intervals are narrow
the steps link them by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arm import TURN
from models.arrays import Bools, Floats, Ints
from optimizer.bounds.ball import Ball

MOST_LIFTS = 6
"""Joints with room for more lifts than this are bounded pose by pose at their nearest lift, whatever the limits."""


@dataclass(frozen=True, eq=False, slots=True)
class Lifted:
    """Bounds of the cost of one joint over N boxes.

    Attributes:
        cost: (N,) lower bound of ``Σ_j (q_j - q*)²``, inf where no path exists.
        outside: (N, m) True where no lift brings the pose inside the limits.
        apart: (N, m) True at the first pose that no chain reaches from the poses before, and at the pose before it.
    """

    cost: Floats
    outside: Bools
    apart: Bools


def cheapest_lifts(values: Ball, lower: float, upper: float, reference: float, max_step: float) -> Lifted:
    """Bound one joint's cost.

    Args:
        values: (N, m) rad, modulo 2π.
        lower: rad, may be -inf. upper: likewise.
        reference: rad, q*.
        max_step: rad, may be inf.
    """
    centre, radius = values.centre, values.radius
    count = (upper - lower) / TURN + 2.0
    if not count < MOST_LIFTS + 1:
        off = np.abs(centre - reference - TURN * np.round((centre - reference) / TURN))
        nowhere = np.zeros(centre.shape, dtype=bool)
        return Lifted(np.sum(np.maximum(off - radius, 0.0) ** 2, axis=-1), nowhere, nowhere)
    open_end = radius >= np.pi
    centre = np.where(open_end, 0.5 * (lower + upper), centre)
    radius = np.where(open_end, 0.5 * (upper - lower), radius)
    first = np.where(open_end, 0.0, np.ceil((lower - centre - radius) / TURN))
    lifts = np.arange(int(count))[:, None, None]
    lifted = centre + TURN * (first + lifts)  # (L, N, m)
    low, high = np.maximum(lifted - radius, lower), np.minimum(lifted + radius, upper)
    cost = np.maximum(np.maximum(low - reference, reference - high), 0.0) ** 2
    possible = (low <= high) & ~(open_end & (lifts > 0))
    cost[~possible] = np.inf
    link = max_step + np.where(open_end, np.inf, radius)
    outside = ~np.any(possible, axis=0)
    # Neighbours may be as far apart as the step and both radii; an end that may be anything is never too far.
    reach = max_step + np.where(open_end[:, 1:] | open_end[:, :-1], np.inf, radius[:, 1:] + radius[:, :-1])
    cheapest, stuck = _cheapest_chain(cost, lifted, reach)
    poses = np.arange(centre.shape[1])
    apart = (stuck[:, None] < len(poses)) & ((poses == stuck[:, None]) | (poses == stuck[:, None] - 1))
    return Lifted(cheapest, outside, apart)


def _cheapest_chain(cost: Floats, lifted: Floats, reach: Floats) -> tuple[Floats, Ints]:
    """Cheapest sum over the poses of cost (L, N, m), neighbours no further apart than ``reach`` (N, m-1).

    Returns:
        The sums (N,), and the first pose that no chain reaches, m where there is none.
    """
    best = cost[..., 0]
    stuck = np.where(np.all(np.isinf(best), axis=0), 0, cost.shape[-1])
    for j in range(1, cost.shape[-1]):
        apart = np.abs(lifted[:, None, :, j - 1] - lifted[None, :, :, j])  # (from, to, N)
        best = np.min(np.where(apart <= reach[:, j - 1], best[:, None], np.inf), axis=0) + cost[..., j]
        stuck = np.where(np.all(np.isinf(best), axis=0), np.minimum(stuck, j), stuck)
    return np.min(best, axis=0), stuck
