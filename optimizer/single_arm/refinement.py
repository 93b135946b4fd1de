"""Usable candidates brought to their optimum on the reduced problem alone, without the local solver.

Local solves lose their way where rows are added one by one, and where a joint step is the largest that is allowed.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.robot.posture import Signs
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.search import SearchParameters
from duocell.optimizer.reduction.base_sample import BoxFrame
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed
from duocell.optimizer.reduction.screening import Candidate, improve
from duocell.optimizer.verification.verify import check


def path_from(problem: ReducedProblem, position: Floats, signs: Signs) -> ArmSolution:
    """The best whole path from a base position (3,) in one posture."""
    paths = evaluate_signed(problem, position[None, :], np.array([signs]))
    return ArmSolution(position, float(paths.yaw[0, 0]), paths.joints[:, 0, 0].T, signs)


def brought_to_optimum(
    cell: Cell,
    problem: ReducedProblem,
    frame: BoxFrame,
    radius: Floats,
    candidates: list[Candidate],
    parameters: SearchParameters,
) -> list[tuple[float, ArmSolution]]:
    """Objective and point of the best of some candidates, improved; those that pass the independent check.

    Args:
        cell: task. problem: of the arm on the whole task. frame: of its box of bases.
        radius: (3,) m, in which candidates are improved at first.
        candidates: usable, best first.
        parameters: of the search.
    """
    local = parameters.local
    better = candidates[: local.finished]
    for share in local.closer:
        better = improve(problem, better, frame, share * radius, local.careful_steps, parameters.screening.cloud)
    points = [(candidate.objective, path_from(problem, candidate.position, candidate.signs)) for candidate in better]
    return [(value, point) for value, point in points if check(cell, problem.arm, point).usable]
