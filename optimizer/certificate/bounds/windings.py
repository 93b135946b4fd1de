"""The cheapest way to shift enclosed joint values by multiples of 2π along a path.

A joint is known modulo 2π and within a radius, pose by pose. A path has to choose a winding at every pose such that the
value can be inside the limits, and such that neighbouring values can be within the largest allowed step. The cost of
a pose at a winding is at least ``w · dist(q*, interval ∩ limits)²``. The cheapest chain of windings is found by dynamic
programming along the path; where no chain exists, no path exists anywhere in the box.

Nothing is unwrapped beforehand, so nothing has to be assumed about neighbouring poses: where the intervals are narrow
the steps link them by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.ball import Ball

MOST_LIFTS = 6
"""Joints with room for more windings than this are bounded pose by pose at their nearest winding, whatever the
limits.
"""


@dataclass(frozen=True, eq=False, slots=True)
class WindingBounds:
    """Bounds of the cost of one joint over N boxes.

    Attributes:
        cost: (N,) lower bound of ``Σ_j count_j (q_j - q*)²``, inf where no path exists.
        each: (N, m) lower bound of its terms, inf where no winding brings the pose inside the limits.
        apart: (N, m) True at neighbours that cannot be linked, or everywhere if only the whole chain is impossible.
    """

    cost: Floats
    each: Floats
    apart: Bools


def cheapest_windings(
    values: Ball, lower: float, upper: float, reference: float, max_step: float, counts: Floats | None = None
) -> WindingBounds:
    """Bound one joint's cost.

    Args:
        values: (N, m) rad, modulo 2π.
        lower: rad, may be -inf. upper: likewise.
        reference: rad, q*.
        max_step: rad, may be inf.
        counts: (m,) what the poses count for; None for 1.
    """
    centre, radius = values.centre, values.radius
    count = (upper - lower) / TURN + 2.0
    if not count < MOST_LIFTS + 1:
        off = np.abs(centre - reference - TURN * np.round((centre - reference) / TURN))
        each = np.maximum(off - radius, 0.0) ** 2
        each = each if counts is None else counts * each
        return WindingBounds(np.sum(each, axis=-1), each, np.zeros(centre.shape, dtype=bool))
    open_end = radius >= np.pi
    centre = np.where(open_end, 0.5 * (lower + upper), centre)
    radius = np.where(open_end, 0.5 * (upper - lower), radius)
    first = np.where(open_end, 0.0, np.ceil((lower - centre - radius) / TURN))
    windings = np.arange(int(count))[:, None, None]
    shifted = centre + TURN * (first + windings)  # (L, N, m)
    low, high = np.maximum(shifted - radius, lower), np.minimum(shifted + radius, upper)
    possible = (low <= high) & ~(open_end & (windings > 0))
    few = max(int(np.max(np.sum(possible, axis=0), initial=1)), 1)  # possible windings come first
    shifted, low, high, possible = shifted[:few], low[:few], high[:few], possible[:few]
    off = np.maximum(np.maximum(low - reference, reference - high), 0.0) ** 2
    cost = np.where(possible, off if counts is None else counts * off, np.inf)
    # Neighbours may be as far apart as the step and both radii; an end that may be anything is never too far.
    reach = max_step + np.where(open_end[:, 1:] | open_end[:, :-1], np.inf, radius[:, 1:] + radius[:, :-1])
    apart = np.abs(shifted[:, None, :, :-1] - shifted[None, :, :, 1:])  # (from, to, N, m-1)
    links = np.where(apart <= reach, cost[None, :, :, 1:], np.inf) + np.where(possible, 0.0, np.inf)[:, None, :, :-1]
    total = np.min(cost[:, None, :, 0] + _joined(links), axis=(0, 1))
    return WindingBounds(total, np.min(cost, axis=0), _breaks(links, np.isinf(total)))


def _joined(links: Floats) -> Floats:
    """Cheapest chains from the first pose to the last: (from, to, N), given those from pose to pose (from, to, N, k).

    Neighbouring links are joined pairwise until one is left: ``(A·B)[a, c] = min over b of A[a, b] + B[b, c]``.
    """
    if links.shape[-1] == 0:
        return np.zeros((1, *links.shape[1:-1]))
    while links.shape[-1] > 1:
        left, right = links[..., 0:-1:2], links[..., 1::2]
        pairs = left[:, :1] + right[:1]
        for b in range(1, links.shape[0]):
            pairs = np.minimum(pairs, left[:, b : b + 1] + right[b : b + 1])
        rest = links[..., 2 * pairs.shape[-1] :]
        links = np.concatenate([pairs, rest], axis=-1) if rest.shape[-1] else pairs
    return links[..., 0]


def _breaks(links: Floats, impossible: Bools) -> Bools:
    """(N, m) True at poses with no link between them; at all poses where only the whole chain is impossible."""
    broken = np.all(np.isinf(links), axis=(0, 1))
    poses = np.zeros((broken.shape[0], broken.shape[1] + 1), dtype=bool)
    poses[:, 1:] |= broken
    poses[:, :-1] |= broken
    poses |= ~np.any(poses, axis=1, keepdims=True)
    return poses & impossible[:, None]


def nearest_windings(values: Ball, lower: float, upper: float, reference: float) -> Floats:
    """(...) lower bound of ``(q - q*)²`` for values (...) [rad] modulo 2π, each by itself; inf outside the limits."""
    centre, radius = values.centre, values.radius
    count = (upper - lower) / TURN + 2.0
    if not count < MOST_LIFTS + 1:
        off = np.abs(centre - reference - TURN * np.round((centre - reference) / TURN))
        return np.maximum(off - radius, 0.0) ** 2
    first = np.ceil((lower - centre - radius) / TURN)
    best = np.full(centre.shape, np.inf)
    for winding in range(int(count)):
        shifted = centre + TURN * (first + winding)
        low, high = np.maximum(shifted - radius, lower), np.minimum(shifted + radius, upper)
        off = np.maximum(np.maximum(low - reference, reference - high), 0.0) ** 2
        best = np.minimum(best, np.where(low <= high, off, np.inf))
    outside = max(lower - reference, reference - upper, 0.0) ** 2
    return np.where(radius >= np.pi, outside, best)
