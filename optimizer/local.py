"""One local solve of one arm, with rows added only where the answer needs them.

Joint steps and conditioning are rarely active, and their rows are many; so the program is solved without them, the
answer is looked at, and they are added where it breaks them.
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
from optimizer.measure import largest_step
from optimizer.pose_rows import BASE
from optimizer.program import ArmPoint, Cuts, build_program
from optimizer.solve import Solve, solve_program

CUT_ROUNDS = 25
TRUST, SMALLEST_TRUST, ALLOWED = 0.4, 1e-3, 0.1
"""rad that joints may move in a round of cuts, at first and at least; share of the conditioning a round may lose."""
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
    leave the last accepted answer by no more than that; an answer where the tangents promised too much is refused and
    the radius shrinks. Without one, the way is shorter but may lose itself.

    Returns:
        The best answer that holds the constraint, or None.
    """
    wanted = float(arm.min_conditioning or 0.0)
    point, before = start, np.inf
    values, gradients = conditioning_gradients(arm, point.joints)
    best: Solve | None = None
    for _ in range(CUT_ROUNDS):
        cuts = _cuts(point.joints, wanted, values, gradients)
        keep = point.signs is not None
        result = _solve(cell, arm, point, deadline, keep_shoulder=keep, steps=steps, cuts=cuts, radius=radius)
        if time.perf_counter() > deadline or radius < SMALLEST_TRUST:
            break
        lowest = -np.inf
        if result.status.has_point:
            new_values, new_gradients = conditioning_gradients(arm, result.points[0].joints)
            lowest = float(np.min(new_values))
        if not result.status.has_point and not np.isfinite(radius):
            break
        if np.isfinite(radius) and lowest < min(wanted, float(np.min(values))) - ALLOWED * wanted:
            radius *= 0.3
            continue
        point, values, gradients, radius = result.points[0], new_values, new_gradients, 1.5 * radius
        if lowest >= wanted:
            best = result if best is None or result.objective < best.objective else best
            if abs(result.objective - before) <= SETTLED * max(1.0, before):
                break
        before = result.objective
    return best


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
