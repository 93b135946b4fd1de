"""Weights of the objective: far enough from the ends of the floating-point numbers that no cost ever leaves them."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput

LEAST_WEIGHT, MOST_WEIGHT = 1e-12, 1e15
"""Of weights that are not 0. A cost is the sum of at most some 1e5 products of two weights and the square of an angle
of at most 1e3 rad: below 1e42. Costs that overflow would be taken for impossible, and exclude what is possible."""


def check_weights(weights: Floats, pointer: str) -> None:
    """Refuse weights with which costs could leave the finite numbers, or vanish.

    Raises:
        InvalidInput: one is negative, no number, or out of range; ``pointer`` with its index.
    """
    usable = (weights == 0.0) | ((weights >= LEAST_WEIGHT) & (weights <= MOST_WEIGHT))
    if not np.all(usable):
        worst = int(np.argmin(usable))
        raise InvalidInput(
            f"the weight is {weights[worst]:g}; it must be 0 or lie between {LEAST_WEIGHT:g} and {MOST_WEIGHT:g}. "
            "Only the ratios of weights matter.",
            f"{pointer}/{worst}",
        )
