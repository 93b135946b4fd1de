"""Inverse kinematics by Newton's method from many seeds, for arms without a closed form or a compiled solver.

Slower than an analytic solver and without a claim of completeness, but ready at once: an analytic solver of a new
general six-joint arm needs about a minute of symbolic preparation before its first answer.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.sampling import even_points
from duocell.models.kinematics.batch_kinematics import forward_and_jacobian, pose_error
from duocell.models.kinematics.chain import chain_of
from duocell.models.robot.arm import TURN
from duocell.models.robot.robot import Robot

SEEDS = 128
ITERATIONS = 25
NEARBY = 15
"""Iterations from joint values that nearly reach."""
CONVERGED = 1e-10
"""m and rad."""
SAME = 1e-3
"""rad or m; solutions closer than this in every joint are one branch (redundant arms: one sample)."""


def numeric_branches(robot: Robot, target: Floats) -> Floats:
    """Distinct joint values (K, n) that reach a flange pose (4, 4) in the base frame: rad modulo 2π, or m."""
    chain = chain_of(robot)
    q = _seeds(robot.dof).copy()
    if robot.slides:
        q[:, 0] = robot.lower[0] + (robot.upper[0] - robot.lower[0]) * (q[:, 0] / TURN + 0.5)
    for _ in range(ITERATIONS):
        rotations, positions, jacobians = forward_and_jacobian(chain, q)
        error = pose_error(rotations, positions, target)
        size = np.sum(error * error, axis=1)
        damping = np.minimum(1e-2, 0.1 * size)[:, None, None] + 1e-14
        transposed = np.swapaxes(jacobians, 1, 2)
        normal = jacobians @ transposed + damping * np.eye(6)
        step = (transposed @ np.linalg.solve(normal, error[..., None]))[..., 0]
        longest = np.max(np.abs(step), axis=1, keepdims=True)
        q += step * np.minimum(1.0, 1.0 / np.maximum(longest, 1e-300))
        if np.all(size < CONVERGED**2):
            break
    rotations, positions, _ = forward_and_jacobian(chain, q)
    good = np.max(np.abs(pose_error(rotations, positions, target)), axis=1) < CONVERGED
    return unique(q[good], robot.prismatic)


def brought_to(robot: Robot, q: Floats, targets: Floats) -> tuple[Floats, Bools]:
    """Joint values that reach flange poses, from others that nearly do.

    Args:
        robot: the chain.
        q: (K, n) rad, near a solution each.
        targets: (K, 4, 4) flange poses in the base frame.

    Returns:
        (K, n) rad, and (K,) True where they reach to within `CONVERGED`.
    """
    chain = chain_of(robot)
    q = q.copy()
    for _ in range(NEARBY):
        rotations, positions, jacobians = forward_and_jacobian(chain, q)
        error = pose_error(rotations, positions, targets)
        size = np.sum(error * error, axis=1)
        if np.all(size < (0.1 * CONVERGED) ** 2):
            break
        damping = np.minimum(1e-6, 1e-3 * size)[:, None, None] + 1e-16
        transposed = np.swapaxes(jacobians, 1, 2)
        normal = jacobians @ transposed + damping * np.eye(6)
        step = (transposed @ np.linalg.solve(normal, error[..., None]))[..., 0]
        longest = np.max(np.abs(step), axis=1, keepdims=True)
        q += step * np.minimum(1.0, 0.2 / np.maximum(longest, 1e-300))
    rotations, positions, _ = forward_and_jacobian(chain, q)
    reached: Bools = np.max(np.abs(pose_error(rotations, positions, targets)), axis=1) < CONVERGED
    return q, reached


@lru_cache(maxsize=4)
def _seeds(n: int) -> Floats:
    return TURN * (even_points(n, SEEDS, 1) - 0.5)


def unique(q: Floats, prismatic: Bools) -> Floats:
    """One of each group of equal solutions (K, n), angles in (-π, π]; ``prismatic`` (n,) values are no angles."""
    wrapped = np.where(prismatic, q, np.arctan2(np.sin(q), np.cos(q)))
    kept: list[Floats] = []
    for row in wrapped:
        apart = [np.max(np.abs(_difference(row, other, prismatic))) > SAME for other in kept]
        if all(apart):
            kept.append(row)
    return np.array(kept).reshape(-1, q.shape[1])


def _difference(one: Floats, other: Floats, prismatic: Bools) -> Floats:
    """(n,) how far two solutions are apart, angles the short way round."""
    apart = one - other
    return np.where(prismatic, apart, np.arctan2(np.sin(apart), np.cos(apart)))
