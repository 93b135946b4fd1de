"""Self-motion against singularities: where σmin/σmax is too small, joints are drawn towards more of it."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.optimizer.single_arm.redundant.unreduced_problem import UnreducedProblem

NEAR = 1.3
"""Postures with less than this many times the wanted conditioning are drawn; above, they may do as they like."""
AIM = 1.1
"""Times the wanted conditioning that they are drawn to: the task takes some of it back."""
DIFFERENCE = 1e-5
"""rad, of the forward differences."""
FARTHEST = 0.3
"""rad, largest wish of a joint."""


def conditioning_values(problem: UnreducedProblem, q: Floats) -> Floats:
    """(N,) σmin/σmax of postures (n, N) at the tool centre point."""
    arm = problem.arm
    return conditioning_of(chain_of(arm.robot), arm.tool, q.T, characteristic_length(arm.robot))


def conditioning_pull(problem: UnreducedProblem, q: Floats, wanted: float, inverse_metric: Floats) -> Floats:
    """(n, N) rad, steps that would lead postures (n, N) to the wanted conditioning by themselves; 0 where they have it.

    The shortest step in the metric that makes up the violation, to first order: ``W⁻¹ g violation / (gᵀ W⁻¹ g)``.
    """
    pull = np.zeros_like(q)
    values = conditioning_values(problem, q)
    low = np.flatnonzero(values < NEAR * wanted)
    if not len(low):
        return pull
    some, n = q[:, low], len(q)
    moved = (some[:, None, :] + DIFFERENCE * np.eye(n)[:, :, None]).reshape(n, -1)
    slopes = (conditioning_values(problem, moved).reshape(n, -1) - values[low]) / DIFFERENCE
    steps = inverse_metric[:, low] * slopes
    violation = np.maximum(AIM * wanted - values[low], 0.0)
    steps *= violation / np.maximum(np.sum(slopes * steps, axis=0), 1e-9)
    longest = np.max(np.abs(steps), axis=0)
    pull[:, low] = steps * np.minimum(1.0, FARTHEST / np.maximum(longest, 1e-12))
    return pull
