"""Evenly spread points: an additive recurrence on the generalised golden ratio (Roberts' R sequence).

About as even as Sobol's points for a few hundred points in two or three dimensions (less so for fewer), for any
number of points, and without the second that importing a statistics library takes in every process.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from duocell.models.base.arrays import Floats


@lru_cache(maxsize=128)
def even_points(dimension: int, count: int, seed: int) -> Floats:
    """(count, dimension) points in [0, 1), read-only; the seed shifts them all by one random vector, modulo 1."""
    steps = np.power(_golden_ratio(dimension), -np.arange(1.0, dimension + 1.0))
    shift = np.random.default_rng(seed).random(dimension)
    points: Floats = np.mod(shift + np.outer(np.arange(count), steps), 1.0)
    points.setflags(write=False)
    return points


def _golden_ratio(dimension: int) -> float:
    """The root above 1 of ``x^(d + 1) = x + 1``, by the contraction ``x = (1 + x)^(1 / (d + 1))``."""
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (dimension + 1.0))
    return root
