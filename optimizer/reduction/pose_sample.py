"""A few poses that stand for a long segment: even along its way, and where its weight in the objective is.

Every pose of the segment counts for the chosen one that is nearest along the way, so that a dwell of hundreds of poses
keeps its share of the objective although one pose stands for it. Chosen are the same poses if the segment is reversed,
or turned about the vertical and shifted with the world.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.pose import rotation_angle

LONGEST_GAP = 0.6
"""rad + m between neighbouring poses of a sample, so that the path between them can still be unwrapped."""
HEAVY, AWAY = 2.0, 0.1
"""Poses that count for this many shares of a sample get one of their own, unless they are, on average, nearer to the
chosen one than this share of a gap."""
TIED = 9
"""Decimals of what is compared: no more are alike in a reversed segment."""


def sample_segment(rotations: Floats, positions: Floats, weights: Floats, count: int) -> tuple[Ints, Floats]:
    """About ``count`` poses of a segment, first and last included, and what they count for.

    Args:
        rotations: (m, 3, 3). positions: (m, 3) m. weights: (m,) of the poses.
        count: how many there should be; more where the way is long, or uneven in its weight.

    Returns:
        (k,) indices, ascending, and (k,) weights with the sum of all weights.
    """
    m = len(positions)
    turned = rotation_angle(np.swapaxes(rotations[:-1], 1, 2) @ rotations[1:])
    arc = np.concatenate([[0.0], np.cumsum(turned + np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    length = float(arc[-1])
    if length == 0.0:
        ends = np.unique([0, m - 1])
        return ends, np.full(len(ends), np.sum(weights) / len(ends))
    count = max(count, int(np.ceil(length / LONGEST_GAP)) + 1, 2)
    if m <= count:
        return np.arange(m), weights
    preference = np.stack([np.abs(arc / length - 0.5), -positions[:, 2], -rotations[:, 2, 2]])
    arc = arc / length
    chosen = _nearest(arc, np.linspace(0.0, 1.0, count), preference)
    chosen[[0, -1]] = 0, m - 1
    chosen = np.unique(chosen)
    return _with_heavy(arc, weights, chosen, preference, count)


def _nearest(arc: Floats, wanted: Floats, preference: Floats) -> Ints:
    """(k,) indices of the poses nearest to places on the way (k,); of equally near ones the most preferred."""
    keys = np.round(preference, TIED)[::-1]
    distances = np.round(np.abs(wanted[:, None] - arc), TIED)
    return np.array([int(np.lexsort((*keys, row))[0]) for row in distances], dtype=np.int64)


def _with_heavy(arc: Floats, weights: Floats, chosen: Ints, preference: Floats, count: int) -> tuple[Ints, Floats]:
    """The sample with poses added where many poses, or heavy ones, are badly stood for; and its weights."""
    total = float(np.sum(weights))
    for _ in range(2):
        shares = _shares(arc, chosen)
        own = shares @ weights
        centre = shares @ (weights * arc) / np.where(own > 0.0, own, 1.0)
        away = shares @ weights * arc[chosen] ** 2 - 2.0 * arc[chosen] * (shares @ (weights * arc))
        away = np.sqrt(np.maximum(away + shares @ (weights * arc**2), 0.0) / np.where(own > 0.0, own, 1.0))
        unlike = (own > HEAVY / count * total) & (away > AWAY / (count - 1))
        more = np.union1d(chosen, _nearest(arc, centre[unlike], preference))
        if len(more) == len(chosen):
            break
        chosen = more
    return chosen, _shares(arc, chosen) @ weights


def _shares(arc: Floats, chosen: Ints) -> Floats:
    """(k, m) the share of every pose that each chosen one stands for: 1 for the nearest, 1/2 where two are as near."""
    distances = np.round(np.abs(arc[chosen][:, None] - arc), TIED)
    nearest = (distances == np.min(distances, axis=0)).astype(np.float64)
    return np.asarray(nearest / np.sum(nearest, axis=0))
