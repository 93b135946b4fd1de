"""A least σmin/σmax kept by tangents: it has no closed form in CasADi, so the program gets linear rows, renewed.

Source of the filter: R. Fletcher, S. Leyffer, Nonlinear programming without a penalty function, Mathematical
Programming 91 (2002).
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.arm import Arm
from duocell.optimizer.nlp.program import ArmSolution, Cuts
from duocell.optimizer.nlp.solve import Solve

CUT_ROUNDS = 25
TRUST, SMALLEST_TRUST, ALLOWED = 0.4, 1e-3, 0.1
"""rad that joints may move in a round of cuts, at first and at least; share of the conditioning a round may lose."""
CLOSE = 0.002
"""Share of the conditioning that an answer may miss if the next one may be further away, and at most is to make up."""
SHRINK, HALVE, GROW = 0.3, 0.5, 1.5
"""What becomes of the radius with an answer that is refused, violates something, or does not."""
LESS = 0.01
"""An answer with a higher objective must violate the conditioning by at least this share less than all before."""
NUDGE = 1e-4
"""Cuts aim at this fraction more than what is asked for, so that their last error does no harm."""
SETTLED = 1e-7
"""Relative change of the objective below which renewed cuts have nothing more to say."""
DIFFERENCE = 1e-6
"""rad, step of the central differences of the conditioning."""

CutSolver = Callable[[ArmSolution, Cuts, float], Solve]
"""Solves the program with cuts from a point, whose joints may move by a radius [rad]."""


def keep_conditioning(
    solve: CutSolver, arm: Arm, start: ArmSolution, deadline: float, radius: float = np.inf
) -> Solve | None:
    """Solve with tangents of σmin/σmax >= min_conditioning, renewed at every answer until they no longer move it.

    Fixed points satisfy the optimality conditions of the constraint itself. With a finite ``radius`` [rad] joints may
    leave the last accepted answer by no more than that; an answer that is worse than an earlier one in objective and
    conditioning (a filter), or where the tangents promised too much, is refused and the radius shrinks. Without one,
    the way is shorter but may lose itself.

    Args:
        solve: of the program with tangents. arm: the arm. start: where to begin.
        deadline: `time.perf_counter` value, soft.
        radius: rad.

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
        result = solve(point, cuts, radius)
        if time.perf_counter() > deadline or radius < SMALLEST_TRUST:
            break
        violation = np.inf
        if result.status.has_point:
            new_values, new_gradients = conditioning_gradients(arm, result.points[0].joints)
            violation = max(wanted - float(np.min(new_values)), 0.0)
        if violation == 0.0 and np.isfinite(before) and abs(result.objective - before) <= SETTLED * max(1.0, before):
            best = result if best is None or result.objective < best.objective else best
            break
        violated = max(wanted - float(np.min(values)), 0.0) if np.isfinite(radius) else np.inf
        if (
            violation == np.inf
            or violation > violated + ALLOWED * wanted
            or _dominated((result.objective, violation), seen)
        ):
            if not np.isfinite(radius):
                break
            radius *= SHRINK
            continue
        point, values, gradients = result.points[0], new_values, new_gradients
        radius *= GROW if violation <= CLOSE * wanted else HALVE
        if violation == 0.0:
            more *= SHRINK
        elif violation <= CLOSE * wanted:  # answers to rows that bend may miss the same little again and again
            more = min(more + violation, CLOSE * wanted)
        seen.append((result.objective, violation))
        before = result.objective
        if violation == 0.0 and (best is None or result.objective < best.objective):
            best = result
    return best


def _dominated(one: tuple[float, float], seen: list[tuple[float, float]]) -> bool:
    """Whether something seen is about as good in the objective and in the violation of the conditioning."""
    objective, violation = one
    return any(
        objective >= (1.0 - SETTLED) * known and violation >= (1.0 - LESS) * violated for known, violated in seen
    )


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
