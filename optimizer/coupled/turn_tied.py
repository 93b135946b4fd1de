"""Bases turned onto their couplings, under arms that stay where they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.arrays import Floats
from models.coupling import Coupling
from optimizer.coupled.place_tied import tie_lacks
from optimizer.coupled.stands import Sieve, Stands

STEPS = 12
"""A turn that ends at a limit is made up for by the other arm, half of it in each step."""
DIFFERENCE = 1e-6
"""rad, of the couplings' derivatives."""


def turned_onto(
    couplings: Sequence[Coupling], sieves: Sequence[Sieve], layouts: Sequence[Stands]
) -> tuple[Stands, ...]:
    """Layouts whose bases are turned as little as the couplings ask for and as their limits allow.

    Args:
        couplings: to keep. sieves: of the arms. layouts: (K) stands of each arm.
    """
    if not couplings:
        return tuple(layouts)
    bases = np.stack([stands.bases for stands in layouts])
    turns = np.stack([stands.turns for stands in layouts])
    by = np.zeros(bases[:, 3].shape)
    units = np.eye(len(bases))
    for _ in range(STEPS):
        lack = tie_lacks(couplings, _turned(bases, by))
        slopes = np.stack(
            [
                (tie_lacks(couplings, _turned(bases, by + DIFFERENCE * unit[:, None])) - lack) / DIFFERENCE
                for unit in units
            ],
            axis=-1,
        )
        if not np.any(np.abs(slopes) > DIFFERENCE):
            return tuple(layouts)
        step = (np.linalg.pinv(slopes, rcond=1e-6) @ lack[..., None])[..., 0]
        by = np.clip(by - step.T, turns[..., 0], turns[..., 1])
    return tuple(stands.turned(sieve.problem, turn) for stands, sieve, turn in zip(layouts, sieves, by, strict=True))


def _turned(bases: Floats, by: Floats) -> list[Floats]:
    """Per arm (4, K) bases, turned by (A, K) rad."""
    return [np.concatenate([base[:3], base[3:] + turn]) for base, turn in zip(bases, by, strict=True)]
