"""Angles modulo 2π."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats

TURN = 2.0 * pi


def wrapped(angle: ArrayLike) -> Floats:
    """In [-π, π)."""
    result: Floats = (np.asarray(angle, dtype=np.float64) + pi) % TURN - pi
    return result


def same_set(first: Floats, second: Floats, tolerance: float) -> bool:
    """True if two lists (k, n) hold the same joint values modulo 2π, each once."""
    if first.shape != second.shape:
        return False
    apart = np.abs(wrapped(first[:, None] - second[None])).max(axis=-1) < tolerance
    return bool(np.all(apart.sum(axis=0) == 1) and np.all(apart.sum(axis=1) == 1))
