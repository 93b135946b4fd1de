"""The reduced problem: one arm's cost as a function of its base position alone.

Where joint 1 turns about the base's z axis, a base yaw only shifts joint 1. Then, for a position (x, y, z) and a
posture, the inverse kinematics give the whole path, the best 2π lift of every joint is a rounding and the best yaw
is a clipped mean. So an uncoupled arm is a search over at most three numbers, whatever the length of the task
(mathematics.md section 3). Everything here is vectorised over positions and postures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arm import TURN, Arm
from models.arrays import Bools, Floats
from models.branches import solve_branches
from models.cell import Cell
from models.chain import chain_of
from models.closed_form import ClosedForm, closed_form
from models.posture import ALL_SIGNS


@dataclass(frozen=True, eq=False, slots=True)
class ReducedProblem:
    """Everything about one arm that does not depend on where it stands.

    Attributes:
        arm: the arm.
        form: its closed form.
        sigma: sense of joint 1 about the world's vertical.
        rotations: (m, 3, 3) flange orientations in the world. positions: (m, 3) m.
        max_step: rad, allowed joint step; infinite where the poses are not consecutive (a sample of a long task).
        postures: (8,) True for branches the request admits.
    """

    arm: Arm
    form: ClosedForm
    sigma: int
    rotations: Floats
    positions: Floats
    max_step: float
    postures: Bools

    def sampled(self, count: int) -> ReducedProblem:
        """The same problem on about ``count`` poses, first and last included; itself if it has no more than that."""
        m = len(self.positions)
        if m <= count:
            return self
        keep = np.unique(np.linspace(0, m - 1, count).round().astype(int))
        return ReducedProblem(
            self.arm, self.form, self.sigma, self.rotations[keep], self.positions[keep], np.inf, self.postures
        )


@dataclass(frozen=True, eq=False, slots=True)
class Paths:
    """Best path per posture and position: the answer of the reduced problem.

    Attributes:
        joints: (6, 8, N, m) rad, unwrapped, lifted, joint 1 for the chosen yaw.
        yaw: (8, N) rad, in the allowed interval.
        objective: (8, N) E of the arm (8.21), also where the path is not allowed.
        missing: (8, N) m, sum over the poses of what reach lacks.
        beyond: (8, N) rad, sum over the joints of what the path sticks out of the limits.
        jump: (8, N) rad, what the largest joint step exceeds the allowed one by.
    """

    joints: Floats
    yaw: Floats
    objective: Floats
    missing: Floats
    beyond: Floats
    jump: Floats

    @property
    def violation(self) -> Floats:
        """(8, N) one number for how far from allowed a path is: metres and radians added; 0 means usable."""
        return self.missing + self.beyond + self.jump


def reduced_problem(cell: Cell, arm: Arm) -> ReducedProblem | None:
    """The reduced problem of one arm, or None if the arm has no closed form or no vertical first axis."""
    form, sigma = closed_form(arm.robot), chain_of(arm.robot).vertical_sign
    if form is None or sigma == 0:
        return None
    targets = cell.flange_targets(arm)
    postures = np.array([arm.posture.admits(signs) for signs in ALL_SIGNS])
    return ReducedProblem(arm, form, sigma, targets[:, :3, :3], targets[:, :3, 3], cell.max_joint_step, postures)


def evaluate(problem: ReducedProblem, positions: Floats) -> Paths:
    """Best path of every posture from every base position.

    Args:
        problem: the arm.
        positions: (N, 3) m, base origins in the world.

    Returns:
        Paths; postures the request excludes have an infinite violation.
    """
    arm = problem.arm
    branches = solve_branches(problem.form, problem.rotations, problem.positions - positions[:, None, :])
    joints, step = _unwrapped(branches.joints)
    beyond = np.zeros(step.shape[1:])
    for i in range(1, 6):
        beyond += _lift(joints[i], arm.lower[i], arm.upper[i], arm.reference[i])
    yaw, out = _choose_yaw(problem, joints[0])
    beyond += out
    error = joints - arm.reference[:, None, None, None]
    objective = np.einsum("i,ikNm,ikNm->kN", arm.weights, error, error, optimize=False)
    jump = np.maximum(np.max(step, axis=0) - problem.max_step, 0.0)
    jump[~problem.postures] = np.inf
    return Paths(joints, yaw, objective, np.sum(branches.missing, axis=-1), beyond, jump)


def _unwrapped(joints: Floats) -> tuple[Floats, Floats]:
    """(continuous joints (6, 8, N, m), largest step (6, 8, N)): every step is taken the short way round."""
    steps = np.diff(joints, axis=-1)
    turns = np.round(steps / TURN)
    steps -= TURN * turns
    joints[..., 1:] -= TURN * np.cumsum(turns, axis=-1)
    return joints, np.max(np.abs(steps), axis=-1, initial=0.0)


def _lift(path: Floats, lower: float, upper: float, reference: float) -> Floats:
    """Shift each path (..., m) in place by the 2π multiple that costs least inside the limits.

    The cost is a convex quadratic of the shift, so the nearest allowed multiple to its minimiser is the best one.

    Returns:
        (...) rad, what sticks out of the limits.
    """
    wanted = np.round((reference - np.mean(path, axis=-1)) / TURN)
    if not np.isfinite(upper - lower):
        path += TURN * wanted[..., None]
        return np.zeros(path.shape[:-1])
    low, high = np.min(path, axis=-1), np.max(path, axis=-1)
    first, last = np.ceil((lower - low) / TURN - 1e-12), np.floor((upper - high) / TURN + 1e-12)
    centred = np.round((0.5 * (lower + upper) - 0.5 * (low + high)) / TURN)
    lifts = np.where(first <= last, np.clip(wanted, first, last), centred)
    path += TURN * lifts[..., None]
    low, high = low + TURN * lifts, high + TURN * lifts
    return np.maximum(lower - low, 0.0) + np.maximum(high - upper, 0.0)


def _choose_yaw(problem: ReducedProblem, path: Floats) -> tuple[Floats, Floats]:
    """Shift joint 1 (8, N, m) in place by the best yaw and 2π lift; (yaw, what sticks out of the limits), both (8, N)."""
    arm, region, sigma = problem.arm, problem.arm.base, problem.sigma
    first = path[..., 0].copy()
    wanted = arm.reference[0] - np.mean(path, axis=-1)
    low = np.broadcast_to(arm.lower[0], wanted.shape) - np.min(path, axis=-1)
    high = np.broadcast_to(arm.upper[0], wanted.shape) - np.max(path, axis=-1)
    shift = np.where(low <= high, np.clip(wanted, low, high), 0.5 * (low + high))
    if not region.yaw_free:
        start = min(-sigma * region.yaw.low, -sigma * region.yaw.high)
        shift = _nearest_allowed(shift, low, high, start, region.yaw.width)
    path += shift[..., None]
    beyond = np.maximum(low - shift, 0.0) + np.maximum(shift - high, 0.0)
    yaw = -sigma * (path[..., 0] - first)
    return region.yaw.low + _modulo(yaw - region.yaw.low, region.yaw.width), beyond


def _nearest_allowed(shift: Floats, low: Floats, high: Floats, start: float, width: float) -> Floats:
    """The best shift of joint 1 in ``[start, start + width] + 2πk``: nearest to ``shift``, inside (low, high) if possible."""
    turn = np.floor((shift - start) / TURN)
    before = np.minimum(shift, start + TURN * turn + width)
    after = start + TURN * (turn + 1.0)
    outside_before = np.maximum(low - before, 0.0) + np.maximum(before - high, 0.0)
    outside_after = np.maximum(low - after, 0.0) + np.maximum(after - high, 0.0)
    worse = (outside_before > outside_after) | (
        (outside_before == outside_after) & (np.abs(before - shift) > np.abs(after - shift))
    )
    return np.where(worse, after, before)


def _modulo(offset: Floats, width: float) -> Floats:
    """``offset`` modulo 2π in [0, width]; rounding that falls just outside is pulled back to the nearer end."""
    wrapped = np.mod(offset, TURN)
    past = wrapped > min(width, TURN)
    nearer_start = TURN - wrapped < wrapped - width
    return np.where(past, np.where(nearer_start, 0.0, min(width, TURN)), wrapped)
