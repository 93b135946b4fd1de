"""Which poses of a task an arm without a reduced problem does not reach, each looked at by itself."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.parameters.unreduced import PARAMETERS
from duocell.optimizer.single_arm.redundant.draws import draw_seeds
from duocell.optimizer.single_arm.redundant.gauss_newton import Iterations, gauss_newton
from duocell.optimizer.single_arm.redundant.ranking import figures
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, unreduced_problem

SEEDS, DRAWN = 64, 2048
"""Postures per pose that are brought to it, and of how many they are the best."""
ITERATIONS = 25
MOST_POSES = 24
"""Poses looked at, spread over the task."""


def unreached_poses(cell: Cell, arm: Arm, box: Floats, seed: int) -> tuple[int, ...]:
    """Indices of poses that no seed reaches from any allowed base; empty says nothing, and no index is a proof.

    Args:
        cell: the task. arm: the arm. box: (3, 2) m, where the base may stand.
        seed: of the draws.
    """
    problem, count = unreduced_problem(cell, arm, box), len(cell.task)
    poses = np.unique(np.linspace(0, count - 1, min(count, MOST_POSES)).round().astype(np.int64))
    return tuple(int(pose) for pose in poses if not _reached(problem, int(pose), seed))


def _reached(problem: UnreducedProblem, pose: int, seed: int) -> bool:
    """True if some seed arrives at one pose."""
    joints, bases = draw_seeds(problem, pose, SEEDS, DRAWN, seed)
    one = problem.only(np.array([pose]), np.ones(1))
    how = Iterations(ITERATIONS, PARAMETERS.reach_pull, PARAMETERS.soft)
    seeds = gauss_newton(one, Seeds(joints[:, None, :], bases), how)
    return bool(np.any(figures(one, seeds).error < PARAMETERS.unreached))
