"""Search of an arm that is not quite as drawn, by rounding or calibration: found on the drawing, kept on the arm.

The arm that was meant (`duocell.models.kinematics.nominal`) has a closed form, so its bases and postures are searched
like those of any such arm. Its optima are starts on the true arm: joints are brought to the poses by Newton's method,
the local solver moves the base to the true optimum, and everything is checked on the true kinematics.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.nominal import Nominal
from duocell.models.kinematics.numeric_inverse import brought_to
from duocell.models.robot.arm import Arm
from duocell.optimizer.budget import boxes_for
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reasons.reasons import explain_proof
from duocell.optimizer.reduction.layers import best_path
from duocell.optimizer.reduction.reduced import ReducedProblem, reduced_problem
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.settings import CertificateSettings

STARTS = 4
"""Optima of the drawing that are taken over."""
DECIDE_WORTH = 5.0
"""s, counted in boxes, of the proof that the arm cannot do what its drawing cannot do."""
APART = 1e-3
"""m and rad; optima nearer to each other are the same start."""


def starts_from(
    cell: Cell, arm: Arm, meant: Nominal, optima: list[tuple[float, ArmSolution]], deadline: float
) -> list[ArmSolution]:
    """Points of the true arm, one for each of the best distinct optima of the drawing.

    Args:
        cell: task.
        arm: the true arm. meant: what it was drawn as.
        optima: (objective, point) of the drawing, best first.
        deadline: `time.perf_counter` value, soft.
    """
    found: list[ArmSolution] = []
    taken: list[ArmSolution] = []
    for _, point in optima:
        if len(found) >= STARTS or time.perf_counter() > deadline:
            break
        if any(_same(point, other) for other in taken):
            continue
        taken.append(point)
        base = arm.base_in_world(point.position, point.yaw)
        q, reached = brought_to(arm.robot, point.joints, inverse(base) @ cell.flange_targets(arm))
        if np.all(reached):
            found.append(ArmSolution(point.position, point.yaw, q, None))
    return found


def paths_from(cell: Cell, arm: Arm, optima: list[tuple[float, ArmSolution]], deadline: float) -> list[ArmSolution]:
    """Paths of the true arm where the drawing has optima, (objective, point), through its own branches."""
    found = []
    for _, point in optima[:STARTS]:
        if time.perf_counter() > deadline:
            break
        path = best_path(cell, arm, point.position, point.yaw)
        if np.isfinite(path.violation):
            found.append(ArmSolution(path.position, path.yaw, path.joints, path.signs))
    return found


def _same(first: ArmSolution, second: ArmSolution) -> bool:
    away = max(float(np.max(np.abs(first.position - second.position))), abs(first.yaw - second.yaw))
    return first.signs == second.signs and away < APART


def problem_of_drawing(cell: Cell, arm: Arm, meant: Nominal) -> ReducedProblem | None:
    """The problem of the drawing with room for what the arm is off it, so that what is proved of it holds for the arm.

    Where the arm itself takes a pose, the drawing with the same joints, base and objective takes one that is displaced
    by no more than that. None where the drawing has no reduced problem.
    """
    return reduced_problem(cell, replace(arm, robot=meant.robot), meant.apart)


def why_impossible(cell: Cell, arm: Arm, meant: Nominal, deadline: float) -> tuple[Reason, ...]:
    """Reasons why the arm itself can not do its task, if some boxes of the drawing prove it; else none."""
    problem = problem_of_drawing(cell, arm, meant)
    if problem is None:
        return ()
    limit, boxes = max(deadline - time.perf_counter(), 0.0), boxes_for(DECIDE_WORTH, len(cell.task))
    proof = certify(problem, None, CertificateSettings(1.0, limit, boxes))
    return explain_proof(cell, problem.arm, proof.causes) if proof.infeasible else ()


def what_is_bounded() -> str:
    """What a proof on the drawing bounds."""
    return "no layout of this arm itself costs less"


def what_is_covered(meant: Nominal) -> str:
    """What a proof on the drawing covers, and why its gap may stay open."""
    return (
        "shown on the closed form that its geometry has but for rounding or calibration, with room for all that it is "
        f"off that: at most {1000.0 * meant.position:.3g} mm and {1000.0 * meant.angle:.3g} mrad at any joint values"
    )
