"""One local solve of one arm, with rows added only where the answer needs them.

Joint steps and conditioning are rarely active, and their rows are many; so the program is solved without them, the
answer is looked at, and they are added where it breaks them. So is the distance that the wrist has to keep from its
singularity: bounds a little inside the side of the wrist, from where the program without them ended.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from models.arm import Arm
from models.arrays import Floats
from models.cell import Cell
from models.chain import chain_of
from models.kinematics import characteristic_length
from models.screws import conditioning_of
from models.wrist_singularity import wrist_shortfall
from optimizer.measure import largest_step
from optimizer.pose_rows import BASE
from optimizer.program import ArmPoint, Cuts, build_program
from optimizer.solve import Solve, solve_program

CUT_ROUNDS = 25
TRUST, SMALLEST_TRUST, ALLOWED = 0.4, 1e-3, 0.1
"""rad that joints may move in a round of cuts, at first and at least; share of the conditioning a round may lose."""
CLOSE = 0.002
"""Share of the conditioning that an answer may lack if the next one may be further away, and at most is to make up."""
SHRINK, HALVE, GROW = 0.3, 0.5, 1.5
"""What becomes of the radius with an answer that is refused, lacks something, or does not."""
LESS = 0.01
"""An answer with a higher objective must lack at least this share less of the conditioning than all before."""
NUDGE = 1e-4
"""Cuts aim at this fraction more than what is asked for, so that their last error does no harm."""
SETTLED = 1e-7
"""Relative change of the objective below which renewed cuts have nothing more to say."""
DIFFERENCE = 1e-6
"""rad, step of the central differences of the conditioning."""


def solve_locally(cell: Cell, arm: Arm, start: ArmPoint, deadline: float) -> Solve:
    """Solve the program of one arm from a start.

    Args:
        cell: task and step limit.
        arm: the arm.
        start: where to begin; its posture is kept.
        deadline: `time.perf_counter` value, soft.

    Returns:
        The last solve; whether its point is usable is for `optimizer.verify` to say.
    """
    result = _solve_rows(cell, replace(arm, avoid_singularities=False), start, deadline)
    if result.status.has_point and wrist_shortfall(arm, result.points[0].joints.T) > 0.0:
        return _solve_rows(cell, arm, result.points[0], deadline)
    return result


def _solve_rows(cell: Cell, arm: Arm, start: ArmPoint, deadline: float) -> Solve:
    """Solve without rows of steps and conditioning, then with those that the answer breaks."""
    keep = start.signs is not None
    result = _solve(cell, arm, start, deadline, keep_shoulder=keep)
    steps = False
    if result.status.has_point and largest_step(cell.task, result.points[0].joints) > cell.max_joint_step:
        steps = True
        result = _solve(cell, arm, start, deadline, keep_shoulder=keep, steps=True)
    if result.status.has_point and arm.min_conditioning is not None:
        values, _ = conditioning_gradients(arm, result.points[0].joints)
        if np.min(values) < arm.min_conditioning:
            held = _keep_conditioning(cell, arm, start, deadline, steps)
            return held or _keep_conditioning(cell, arm, start, deadline, steps, TRUST) or result
    return result


def _solve(
    cell: Cell,
    arm: Arm,
    start: ArmPoint,
    deadline: float,
    *,
    keep_shoulder: bool,
    steps: bool = False,
    cuts: Cuts | None = None,
    radius: float = np.inf,
) -> Solve:
    program = build_program(
        cell, [arm], [start], keep_shoulder=keep_shoulder, steps=steps, cuts=None if cuts is None else [cuts]
    )
    if np.isfinite(radius):
        reach = np.full(len(program.lower), radius)
        reach[:BASE] = np.inf
        here = program.pack([start])
        program = replace(
            program, lower=np.maximum(program.lower, here - reach), upper=np.minimum(program.upper, here + reach)
        )
    return solve_program(program, [start], max(deadline - time.perf_counter(), 0.05))


def _keep_conditioning(
    cell: Cell, arm: Arm, start: ArmPoint, deadline: float, steps: bool, radius: float = np.inf
) -> Solve | None:
    """Solve with tangents of σmin/σmax >= min_conditioning, renewed at every answer until they no longer move it.

    Fixed points satisfy the optimality conditions of the constraint itself. With a finite ``radius`` [rad] joints may
    leave the last accepted answer by no more than that; an answer that is worse than an earlier one in objective and
    conditioning (a filter), or where the tangents promised too much, is refused and the radius shrinks. Without one,
    the way is shorter but may lose itself.

    Returns:
        The best answer that holds the constraint, or None.
    """
    wanted = float(arm.min_conditioning or 0.0)
    point, before, more = start, np.inf, 0.0
    values, gradients = conditioning_gradients(arm, point.joints)
    best: Solve | None = None
    seen: list[tuple[float, float]] = []
    for _ in range(CUT_ROUNDS):
        cuts = _cuts(point.joints, wanted + more, values, gradients)
        keep = point.signs is not None
        result = _solve(cell, arm, point, deadline, keep_shoulder=keep, steps=steps, cuts=cuts, radius=radius)
        if time.perf_counter() > deadline or radius < SMALLEST_TRUST:
            break
        lacks = np.inf
        if result.status.has_point:
            new_values, new_gradients = conditioning_gradients(arm, result.points[0].joints)
            lacks = max(wanted - float(np.min(new_values)), 0.0)
        if lacks == 0.0 and np.isfinite(before) and abs(result.objective - before) <= SETTLED * max(1.0, before):
            best = result if best is None or result.objective < best.objective else best
            break
        lacked = max(wanted - float(np.min(values)), 0.0) if np.isfinite(radius) else np.inf
        if lacks == np.inf or lacks > lacked + ALLOWED * wanted or _dominated((result.objective, lacks), seen):
            if not np.isfinite(radius):
                break
            radius *= SHRINK
            continue
        point, values, gradients = result.points[0], new_values, new_gradients
        radius *= GROW if lacks <= CLOSE * wanted else HALVE
        if lacks == 0.0:
            more *= SHRINK
        elif lacks <= CLOSE * wanted:  # answers to rows that bend may lack the same little again and again
            more = min(more + lacks, CLOSE * wanted)
        seen.append((result.objective, lacks))
        before = result.objective
        if lacks == 0.0 and (best is None or result.objective < best.objective):
            best = result
    return best


def _dominated(one: tuple[float, float], seen: list[tuple[float, float]]) -> bool:
    """Whether something seen is about as good in the objective and in what it lacks of the conditioning."""
    objective, lacks = one
    return any(objective >= (1.0 - SETTLED) * known and lacks >= (1.0 - LESS) * lacked for known, lacked in seen)


def _cuts(joints: Floats, wanted: float, values: Floats, gradients: Floats) -> Cuts:
    near = values < 2.0 * wanted
    bounds = np.where(near, wanted * (1.0 + NUDGE) - values + np.sum(gradients * joints, axis=1), -np.inf)
    return Cuts(np.where(near[:, None], gradients, 0.0), bounds)


def conditioning_gradients(arm: Arm, joints: Floats) -> tuple[Floats, Floats]:
    """σmin/σmax (m,) and its derivative by the joints (m, n), by central differences."""
    chain, length = chain_of(arm.robot), characteristic_length(arm.robot)
    m, n = joints.shape
    offsets = np.concatenate([np.zeros((1, n)), DIFFERENCE * np.eye(n), -DIFFERENCE * np.eye(n)])
    values = conditioning_of(chain, arm.tool, (joints[:, None, :] + offsets).reshape(-1, n), length)
    values = values.reshape(m, 2 * n + 1)
    return values[:, 0], (values[:, 1 : n + 1] - values[:, n + 1 :]) / (2.0 * DIFFERENCE)
