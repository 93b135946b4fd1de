"""Angles modulo 2π."""

from __future__ import annotations

from math import pi

import numpy as np

TURN = 2.0 * pi


def wrapped(angle):
    """In [-π, π)."""
    return (np.asarray(angle) + pi) % TURN - pi


def same_set(first: np.ndarray, second: np.ndarray, tolerance: float) -> bool:
    """True if two lists (k, n) hold the same joint values modulo 2π, each once."""
    if first.shape != second.shape:
        return False
    apart = np.abs(wrapped(first[:, None] - second[None])).max(axis=-1) < tolerance
    return bool(np.all(apart.sum(axis=0) == 1) and np.all(apart.sum(axis=1) == 1))
