"""Where points of a spread and local solves from them may miss the best base: signs of slivers.

Beside a singular wrist the joints of the wrist turn by half a turn within millimetres of the base, and a joint step at
its limit cuts usable bases into strips that may be thinner than a millimetre. Where the answer is at one of these,
there may be more of them.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.wrist_singularity import wrist_distance
from duocell.optimizer.nlp.measure import largest_step, objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem

WRIST = 0.05
"""rad between the wrist and its singularity from which on nothing is to be feared."""
STEP = 0.95
"""Share of the allowed joint step up to which nothing is to be feared."""
ACTIVE = 1e-5
"""rad from a limit that is active."""
SAME = 1e-3
"""Relative difference of objectives that are about the same: a way that could not be gone was repaired by less."""


def at_limit(cell: Cell, problem: ReducedProblem, best: ArmSolution) -> bool:
    """True if a joint is at its limit or makes the largest step that is allowed."""
    margin = -float(np.max(problem.arm.limit_excess(best.joints)))
    return margin < ACTIVE or largest_step(cell.task, problem.arm.robot, best.joints) > cell.max_joint_step - ACTIVE


def in_doubt(cell: Cell, problem: ReducedProblem, box: Floats, best: ArmSolution, least: float) -> bool:
    """True if something better may lie in a sliver.

    Args:
        cell: the task. problem: of the arm. box: (3, 2) m, bases that are searched.
        best: the answer of the local solves.
        least: least objective that any of them reached. What is better than the answer cannot go its whole way, and
            would be all that is found.
    """
    value = objective_of(cell, problem.arm, best.joints)
    if not np.any(box[:, 1] > box[:, 0]) or value > (1.0 + SAME) * least:
        return False
    nearest = float(np.min(wrist_distance(problem.form.wrist_zero, best.joints[:, 4])))
    return nearest < WRIST or largest_step(cell.task, problem.arm.robot, best.joints) > STEP * cell.max_joint_step
