"""When two layouts are neighbours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.optimizer.nlp.program import ArmSolution


def nearby(points: Sequence[ArmSolution], others: Sequence[ArmSolution], distance: float) -> bool:
    """True for layouts in the same postures whose bases are nearer than ``distance`` [m] to each other."""
    return all(
        p.signs == q.signs and float(np.max(np.abs(p.position - q.position))) < distance
        for p, q in zip(points, others, strict=True)
    )
