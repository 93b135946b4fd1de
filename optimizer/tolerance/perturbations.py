"""Which errors to look at: the corners of what is allowed, an even spread inside, and the errors that hurt most."""

from __future__ import annotations

from itertools import product

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.sampling import even_points
from duocell.optimizer.nlp.pose_rows import BASE
from duocell.optimizer.tolerance.sensitivity import Sensitivity

CORNERS: Floats = np.array(list(product((1.0, -1.0), repeat=BASE)))
"""(16, 4) of one base."""
SPREAD = 32
AIMED = 16
"""Rows that are nearest to being used up and get errors of their own."""


def error_samples(arms: int, rows: Sensitivity, seed: int) -> Floats:
    """Errors of all bases as shares of the largest allowed ones.

    Every base visits its sixteen corners, all bases going the same way and neighbours going opposite ways. For the rows
    that are used up first, all bases go the way that costs most: to the corner of their box, and straight down the
    slope, which is worse where a distance is curved.

    Args:
        arms: A. rows: what the layout is short of. seed: of the spread.

    Returns:
        (N, A, 4) in [-1, 1], all different.
    """
    together = np.repeat(CORNERS[:, None], arms, axis=1)
    opposite = together * np.where(np.arange(arms) % 2, -1.0, 1.0)[:, None]
    spread = 2.0 * even_points(BASE * arms, SPREAD, seed).reshape(-1, arms, BASE) - 1.0
    first = np.argsort(rows.factors, kind="stable")[:AIMED]
    slopes = rows.slopes[first]
    steepest = np.max(np.abs(slopes), axis=(1, 2), keepdims=True, initial=1e-300)
    return _different(np.concatenate([together, opposite, spread, -np.sign(slopes), -slopes / steepest]))


def _different(errors: Floats) -> Floats:
    """Without repetitions, in order."""
    _, first = np.unique(errors.round(9), axis=0, return_index=True)
    kept: Floats = errors[np.sort(first)]
    return kept
