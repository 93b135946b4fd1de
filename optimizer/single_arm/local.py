"""One local solve of one arm, with rows added only where the answer needs them.

Joint steps and conditioning are rarely active, and their rows are many; so the program is solved without them, the
answer is looked at, and they are added where it breaks them. So are the distances to be kept from singularities: bounds
a little inside the sides of shoulder, elbow and wrist, from where the program without them ended.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.cell.singular_margins import violations_at_poses
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.wrist_singularity import wrist_shortfall
from duocell.models.robot.arm import Arm
from duocell.optimizer.monitoring.events import Started
from duocell.optimizer.monitoring.watch import tell
from duocell.optimizer.nlp.conditioning_cuts import TRUST, conditioning_gradients, keep_conditioning
from duocell.optimizer.nlp.measure import step_excess
from duocell.optimizer.nlp.pose_rows import BASE
from duocell.optimizer.nlp.program import ArmSolution, Cuts, build_program
from duocell.optimizer.nlp.solve import Solve, solve_program
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.verification.verify import check

CLEAR = 1e-3
"""Relative rise of the objective for which ways keep clear of singularities also where they begin and end."""


def solved_from(
    cell: Cell, search: ArmSearch, start: ArmSolution, deadline: float, known: float = np.inf
) -> list[tuple[float, ArmSolution]]:
    """The optimum reached from a start, if it passes the independent check; if below ``known``, surely."""
    if time.perf_counter() > deadline:
        search.finished = False
        return []
    now = time.perf_counter()
    share = max(
        search.local.share * (deadline - now),
        min(search.local.solve_pose * len(cell.task), deadline - now),
    )
    result = solve_locally(cell, search.arm, start, now + share, known)
    search.starts += 1
    if result.engine_status == "Maximum_WallTime_Exceeded":
        search.finished = False
    point = result.points[0]
    usable = result.status.has_point and check(cell, search.arm, point).usable
    objective = result.objective if usable else None
    tell(Started(search.arm.name, search.starts, result.status.value, objective, result.iterations))
    return [(result.objective, point)] if usable else []


def solve_locally(cell: Cell, arm: Arm, start: ArmSolution, deadline: float, known: float = np.inf) -> Solve:
    """Solve the program of one arm from a start.

    Args:
        cell: task and step limit.
        arm: the arm.
        start: where to begin; its posture is kept.
        deadline: `time.perf_counter` value, soft.
        known: objective; where an answer without the rows that it breaks costs more, no rows are added to it.

    Returns:
        The last solve; whether its point is usable is for `duocell.optimizer.verification.verify` to say.
    """
    result = _solve_rows(cell, replace(arm, avoid_singularities=False), start, deadline, known=known)
    if not result.status.has_point or result.objective > known:
        return result
    point = result.points[0]
    through, beside = touches(cell, arm, point)
    if through or beside:
        clear = _solve_rows(cell, arm, point, deadline, clear=True)
        if clear.status.has_point and (through or clear.objective <= (1.0 + CLEAR) * result.objective):
            return clear
    if wrist_shortfall(arm, point.joints.T) > 0.0:
        return _solve_rows(cell, arm, point, deadline)
    return result


def touches(cell: Cell, arm: Arm, point: ArmSolution) -> tuple[bool, bool]:
    """Whether a way goes through a pose too near a singularity, and whether one begins or ends at such a pose."""
    form = closed_form(arm.robot)
    if form is None or point.signs is None:
        return False, False
    through, allowed = violations_at_poses(arm, cell.task, point.joints)
    return bool(np.any(through)), bool(np.any(allowed > 0.0))


def worse_for_its_ends(cell: Cell, arm: Arm, best: ArmSolution, point: ArmSolution) -> float:
    """By which factor a point must beat the best one, where that keeps clear of singularities at its ends too."""
    clear = not touches(cell, arm, best)[1]
    return 1.0 - CLEAR if clear and touches(cell, arm, point)[1] else 1.0


def _solve_rows(
    cell: Cell, arm: Arm, start: ArmSolution, deadline: float, *, clear: bool = False, known: float = np.inf
) -> Solve:
    """Solve without rows of steps and conditioning, then with those that the answer breaks."""
    keep = start.signs is not None
    result = _solve(cell, arm, start, deadline, keep_shoulder=keep, clear=clear)
    steps = False
    if result.objective > known:
        return result
    if result.status.has_point and not steps_kept(cell, arm, result.points[0]):
        steps = True
        result = _solve(cell, arm, start, deadline, keep_shoulder=keep, clear=clear, steps=True)
    if result.status.has_point and arm.min_conditioning is not None and result.objective <= known:
        values, _ = conditioning_gradients(arm, result.points[0].joints)
        if np.min(values) < arm.min_conditioning:

            def solve(point: ArmSolution, cuts: Cuts, radius: float) -> Solve:
                rows = {"keep_shoulder": keep, "clear": clear, "steps": steps}
                return _solve(cell, arm, point, deadline, **rows, cuts=cuts, radius=radius)

            held = keep_conditioning(solve, arm, start, deadline)
            return held or keep_conditioning(solve, arm, start, deadline, TRUST) or result
    return result


def steps_kept(cell: Cell, arm: Arm, point: ArmSolution) -> bool:
    """True if neither joints nor the parameters that poses leave open change by more than they may."""
    if step_excess(cell, arm, point.joints) > 0.0:
        return False
    return point.free is None or cell.freedom(arm).step_excess(point.free, cell.task.joined) <= 0.0


def _solve(
    cell: Cell,
    arm: Arm,
    start: ArmSolution,
    deadline: float,
    *,
    keep_shoulder: bool,
    clear: bool,
    steps: bool = False,
    cuts: Cuts | None = None,
    radius: float = np.inf,
) -> Solve:
    rows = None if cuts is None else [cuts]
    program = build_program(cell, [arm], [start], keep_shoulder=keep_shoulder, steps=steps, clear=clear, cuts=rows)
    if np.isfinite(radius):
        reach = np.full(len(program.lower), radius)
        reach[:BASE] = np.inf
        here = program.pack([start])
        program = replace(
            program, lower=np.maximum(program.lower, here - reach), upper=np.minimum(program.upper, here + reach)
        )
    return solve_program(program, [start], max(deadline - time.perf_counter(), 0.05))
