r"""The best conditioning that an arm can have anywhere in a box.

Seen from the hand, held in place by the task, the column of the Jacobian of joint k is the screw ``ξ_k = (v_k, a_k)``
about the tool centre point P, with ``v_k = a_k x (P - o_k) / L``. Joint l moves the columns of the joints before it,

    dξ_k = -(a_l x v_k + v_l x a_k, a_l x a_k) dq_l        for k < l,

and no others: nothing depends on joint 1. The map on the right makes ξ_k longer by a factor of ``A_l = 1 + ρ_l/L`` at
most, with ρ_l the distance of P from axis l.

Let v be the last right singular vector at the centre c of the box and δ_l the change of joint l, |δ_l| <= Δ_l. Then

    σmin(q) <= |J(q) v| <= |J_c v + Σ_l δ_l ∂_l J v| + ½ (Σ_l Δ_l A_l)² √(Σ_k 1 + (ρ_k/L)²),
    σmax(q) >= σmax(c) - Σ_l Δ_l |∂_l J| - the same remainder,

with the largest ρ in the box in the remainders (`motion`: R). Where the joints are differentiable δ is linear in the
base's place up to ``e``, the norm is convex in it and largest at a corner of the box; else each |δ_l| is taken at its
largest.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.difference import SAME, Difference
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.arm import Arm
from duocell.optimizer.certificate.bounds.angles.joints import Kinematics
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE
from duocell.optimizer.certificate.exclusion.motion import ON_TARGET, Motion, motion
from duocell.optimizer.reduction.reduced import ReducedProblem

AT_ONCE = 4000
"""Poses times boxes looked at together."""


@dataclass(frozen=True, eq=False, slots=True)
class _Screws:
    """Jacobians J (q, 6, 6) in the world about the tool, and their derivatives (q, 6, 6, 6): joint, row, column."""

    jacobian: Floats
    derivative: Floats


def conditioning_slacks(moved: Motion, arm: Arm, apart: Difference = SAME) -> Floats:
    """(N, m) no base in a box has a σmin/σmax more than this beyond ``arm.min_conditioning`` at a pose.

    Args:
        moved: over N boxes. arm: with a smallest conditioning.
        apart: how far the arm that is asked about is from this one.
    """
    count, m = moved.joints.shape[:2]
    box, pose = (index.ravel() for index in np.indices((count, m)))
    length = characteristic_length(arm.robot)
    flange = moved.frames[box, pose, 6] @ arm.robot.flange_placement
    tool = flange[:, :3, :3] @ arm.tool[:3, 3] + flange[:, :3, 3]
    velocity, distance, swing = moved.swings(box, pose, tool)
    farthest = (distance + np.sum(swing, axis=1, keepdims=True) - np.cumsum(swing, axis=1)) / length
    change = moved.change[box, pose].copy()
    change[:, 0] = 0.0
    screws = _screws(moved.axes[box, pose], velocity / length)
    _, sigma, right = np.linalg.svd(screws.jacobian)
    remainder = 0.5 * np.sum(change * (1.0 + farthest), axis=1) ** 2 * np.sqrt(np.sum(1.0 + farthest**2, axis=1))
    remainder = remainder + jacobian_apart(arm, apart)
    smallest = _weakest(moved, box, pose, screws, right[:, -1], change) + remainder
    norms = np.sqrt(np.einsum("qlrk,qlrk->ql", screws.derivative, screws.derivative))
    largest = sigma[:, 0] - np.sum(change * norms, axis=1) - remainder
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(largest > 0.0, smallest / np.where(largest > 0.0, largest, 1.0), np.inf)
    slack: Floats = np.where(np.isnan(ratio), np.inf, ratio).reshape(count, m) - float(arm.min_conditioning or 0.0)
    return slack


def poorly_conditioned(problem: ReducedProblem, kinematics: Kinematics, boxes: Boxes) -> Bools:
    """(N, m) True where no base in a box keeps the smallest conditioning of an arm at a pose; False if none is asked.

    Args:
        problem: of the arm. kinematics: of it, for the same poses. boxes: N of them.
    """
    arm, m = problem.arm, len(problem.positions)
    if arm.min_conditioning is None:
        return np.zeros((len(boxes), m), dtype=np.bool_)
    targets = np.tile(np.eye(4), (m, 1, 1))
    targets[:, :3, :3], targets[:, :3, 3] = kinematics.targets.mount @ problem.rotations, problem.positions
    step = max(AT_ONCE // m, 1)
    parts = [boxes[at : at + step] for at in range(0, len(boxes), step)]
    slacks = [conditioning_slacks(motion(arm, kinematics, targets, part), arm, problem.apart) for part in parts]
    lost: Bools = np.concatenate([np.zeros((0, m)), *slacks]) < -TOLERANCE
    return lost


def jacobian_apart(arm: Arm, apart: Difference) -> float:
    """How far the Jacobian of another arm is from this one's at the same joint values: a bound of the norm.

    Both as seen from the hand, linear rows divided by each arm's length. With φ the angle of the difference and R the
    length of the chain and the tool, an axis is turned by φ and shifted by φ R + 2 Σ d_i at most.
    """
    if apart == SAME:
        return 0.0
    chain, length = chain_of(arm.robot), characteristic_length(arm.robot)
    places = np.array([*chain.points, chain.home[:3, 3], chain.home[:3, :3] @ arm.tool[:3, 3] + chain.home[:3, 3]])
    links = float(np.sum(np.linalg.norm(np.diff(places, axis=0), axis=1)))
    shift = apart.angle * links + apart.offsets
    velocity = apart.angle * links + shift + apart.length * (links + shift)
    return float(np.sqrt(6.0) * np.hypot(velocity / length, apart.angle))


def _screws(axes: Floats, velocity: Floats) -> _Screws:
    """From directions (q, 6, 3) of the joints and velocities (q, 6, 3) of the tool, divided by the length."""
    jacobian = np.concatenate([velocity, axes], axis=2).swapaxes(1, 2)
    derivative = np.zeros((len(axes), 6, 6, 6))
    for joint in range(1, 6):
        a, v = axes[:, joint, None], velocity[:, joint, None]
        before, turned = velocity[:, :joint], axes[:, :joint]
        derivative[:, joint, :3, :joint] = -(np.cross(a, before) + np.cross(v, turned)).swapaxes(1, 2)
        derivative[:, joint, 3:, :joint] = -np.cross(a, turned).swapaxes(1, 2)
    return _Screws(jacobian, derivative)


def _weakest(moved: Motion, box: Ints, pose: Ints, screws: _Screws, weakest: Floats, change: Floats) -> Floats:
    """(q,) the largest |J v| to first order over boxes, for directions v (q, 6) of joint space."""
    here = np.einsum("qrk,qk->qr", screws.jacobian, weakest)
    slopes = np.einsum("qlrk,qk->qlr", screws.derivative, weakest)
    lengths = np.sqrt(np.einsum("qlr,qlr->ql", slopes, slopes))
    anyhow = np.linalg.norm(here, axis=1) + np.sum(change * lengths, axis=1)
    half = moved.half[box]
    corners = np.array(list(product((-1.0, 1.0), repeat=half.shape[1])))
    by_place = np.einsum("qlr,qlK,qK->qrK", slopes, moved.slopes[box, pose], half)
    at_corners = here[:, None] + np.einsum("qrK,vK->qvr", by_place, corners)
    rest = np.sum(moved.rest[box, pose] * lengths, axis=1)
    linear = np.max(np.linalg.norm(at_corners, axis=2), axis=1) + rest
    known = moved.regular[box, pose] & (moved.error[box, pose] < ON_TARGET)
    return np.asarray(np.where(known, np.fmin(linear, anyhow), anyhow))
