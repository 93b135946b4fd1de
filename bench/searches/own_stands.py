"""What one arm can do from given base places, by `bench.searches.own_arm` alone: paths, yaw, cost, violations.

The rules are those of the product, read a second time: one branch for all poses, joints that go on without jumps inside
a segment, any turns a segment likes, the yaw of the base shared by all segments, wrists away from their singularity.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from bench.searches.own_arm import OwnArm, inverse, own_arm
from duocell.models.base.arrays import Bools, Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.arm import SINGULAR_WRIST, TURN, Arm

YAWS = 72
"""Yaws from which a task sequence chooses, before the best of them is refined."""
UNREACHED, EXCEEDED = 10.0, 1.0
"""Cost of a pose without inverse and of a radian beyond, in units of `OwnTask.scale`: what searches go by."""


@dataclass(frozen=True, eq=False)
class OwnTask:
    """One arm's part of a cell.

    Attributes:
        arm: limits, region, weights. own: its kinematics. sense: +1 or -1, joint 1 about the base's z.
        rotations: (m, 3, 3) flange in axes of the mount. positions: (m, 3) m in the world.
        segments: poses of each segment. weights: (m,). max_step: rad. scale: cost that is large for this task.
    """

    arm: Arm
    own: OwnArm
    sense: float
    rotations: Floats
    positions: Floats
    segments: tuple[slice, ...]
    weights: Floats
    max_step: float
    scale: float


@dataclass(frozen=True, eq=False)
class OwnStands:
    """Best paths of the eight branches from N places.

    Attributes:
        objective: (8, N) E of the arm. wrong: (8, N) 0 where the path is usable, else how far from it, in cost.
        yaw: (8, N) rad. joints: (8, N, m, 6) rad for this yaw.
    """

    objective: Floats
    wrong: Floats
    yaw: Floats
    joints: Floats

    @property
    def usable(self) -> Bools:
        """(8, N) True where the arm can do its part."""
        free: Bools = self.wrong == 0.0
        return free


def own_task(cell: Cell, index: int) -> OwnTask:
    """One arm's part of a cell.

    Raises:
        ValueError: the arm is not of a kind that `bench.searches.own_arm` solves, or its first axis is not its base's.
    """
    arm = cell.arms[index]
    own = own_arm(arm.robot)
    if own is None or abs(abs(own.axes[0, 2]) - 1.0) > 1e-9 or np.hypot(*own.points[0, :2]) > 1e-9:
        raise ValueError(f"{arm.robot.name} has no inverse of our own")
    targets = cell.flange_targets(arm)
    total = float(np.sum(cell.task.weights)) or len(cell.task)
    return OwnTask(
        arm,
        own,
        float(np.sign(own.axes[0, 2])),
        arm.mount.T @ targets[:, :3, :3],
        targets[:, :3, 3],
        cell.task.segments,
        cell.task.weights,
        cell.max_joint_step,
        total * max(float(np.sum(arm.weights)), 1.0),
    )


def own_stands(task: OwnTask, places: Floats, yaws: Floats | None = None) -> OwnStands:
    """Paths from base places.

    Args:
        task: the arm's part. places: (N, 3) m, base origins in the world.
        yaws: (N,) rad if the yaw is not to be chosen.
    """
    arm = task.arm
    seen = (task.positions - places[:, None, :]) @ arm.mount
    joints, exist = inverse(task.own, task.rotations, seen)
    wrong = UNREACHED * np.sum(~exist, axis=-1) / len(task.positions)
    for segment in task.segments:
        joints[:, :, segment] = np.unwrap(joints[:, :, segment], axis=2)
        steps = np.abs(np.diff(joints[:, :, segment], axis=2))
        wrong += EXCEEDED * np.maximum(np.max(steps, axis=(2, 3), initial=0.0) - task.max_step, 0.0)
    if arm.avoid_singularities:
        wrong += np.maximum(SINGULAR_WRIST - wrist_angles(task.own, joints), 0.0).max(axis=-1) * (EXCEEDED * 100.0)
    for i in range(1, 6):
        for segment in task.segments:
            wrong += EXCEEDED * _lift(task, joints, segment, i)
    yaw, beyond = _turned(task, joints) if yaws is None else _as_given(task, joints, yaws)
    wrong += EXCEEDED * beyond
    if arm.min_conditioning is not None:
        usable = wrong == 0.0
        violation = np.maximum(arm.min_conditioning - conditioning(task, joints[usable]).min(axis=-1, initial=1.0), 0.0)
        wrong[usable] += EXCEEDED * violation
    error = joints - arm.reference
    objective = np.einsum("knmi,i,m->kn", error * error, arm.weights, task.weights)
    return OwnStands(objective, wrong * task.scale, yaw, joints)


def wrist_angles(own: OwnArm, joints: Floats) -> Floats:
    """(..., m) rad, angle between the lines of axes 4 and 6: how far a wrist is from its singularity."""
    h4, h5, h6 = own.axes[3:]
    aside = np.cross(h5, h6)
    flat = h6 - (h5 @ h6) * h5
    q5 = joints[..., 4]
    along = (h5 @ h6) * float(h5 @ h4) + np.cos(q5) * float(flat @ h4) + np.sin(q5) * float(aside @ h4)
    angle: Floats = np.arccos(np.clip(np.abs(along), 0.0, 1.0))
    return angle


def _lift(task: OwnTask, joints: Floats, segment: slice, i: int) -> Floats:
    """Joint ``i`` of a segment by whole turns into its limits, as near to the reference as they let it; what is
    beyond.
    """
    path, arm = joints[:, :, segment, i], task.arm
    first = np.ceil((arm.lower[i] - path.min(axis=-1) - 1e-12) / TURN)
    last = np.floor((arm.upper[i] - path.max(axis=-1) + 1e-12) / TURN)
    wanted = np.round((arm.reference[i] - _mean(task, path, segment)) / TURN)
    turns = np.where(first <= last, np.clip(wanted, first, np.maximum(first, last)), wanted)
    path += TURN * turns[..., None]
    out = np.maximum(arm.lower[i] - path.min(axis=-1), path.max(axis=-1) - arm.upper[i])
    return np.where(first <= last, 0.0, np.maximum(out, 1e-9))


def _mean(task: OwnTask, path: Floats, segment: slice) -> Floats:
    """Weighted mean over the poses of a segment; plain where they weigh nothing."""
    weights = task.weights[segment]
    total = float(np.sum(weights))
    mean: Floats = path @ weights / total if total > 0.0 else path.mean(axis=-1)
    return mean


def _turned(task: OwnTask, joints: Floats) -> tuple[Floats, Floats]:
    """Choose the yaw (8, N), turn joint 1 back by it; how far joint 1 is beyond its limits then."""
    starts = np.array([segment.start for segment in task.segments])
    first, base = joints[..., 0], task.arm.base
    low = task.arm.lower[0] - np.minimum.reduceat(first, starts, axis=-1)  # (8, N, segments) of the common shift
    high = task.arm.upper[0] - np.maximum.reduceat(first, starts, axis=-1)
    best = task.arm.reference[0] - np.stack([_mean(task, first[..., j], j) for j in task.segments], axis=-1)
    heavy = np.array([float(np.sum(task.weights[j])) for j in task.segments])
    middle, half = (0.0, pi) if base.yaw_free else (base.yaw.middle, 0.5 * base.yaw.width)
    grid = np.linspace(middle - half, middle + half, YAWS if half > 0.0 else 1)
    tried = -task.sense * np.broadcast_to(grid, (*first.shape[:-1], len(grid)))
    for _ in range(3):
        cost, out, better = _of_shifts(tried, low, high, best, heavy)
        pick = np.argmin(np.where(out > 0.0, 1e12 * (1.0 + out), cost), axis=-1)[..., None]
        centre = np.take_along_axis(np.stack([tried, better]), pick[None], axis=-1)
        if not base.yaw_free:
            least, most = sorted((-task.sense * (middle - half), -task.sense * (middle + half)))
            centre = np.clip(centre, least, most)
        tried = np.concatenate([*centre, 0.5 * (centre[0] + centre[1])], axis=-1)
    cost, out, _ = _of_shifts(tried, low, high, best, heavy)
    pick = np.argmin(np.where(out > 0.0, 1e12 * (1.0 + out), cost), axis=-1)[..., None]
    return _as_given(task, joints, -task.sense * np.take_along_axis(tried, pick, axis=-1)[..., 0])


def _of_shifts(tried: Floats, low: Floats, high: Floats, best: Floats, heavy: Floats) -> tuple[Floats, Floats, Floats]:
    """Cost, excess [rad] and best shift near by, (..., K), of shifts ``tried`` (..., K) of joint 1 for all segments."""
    shift = tried[..., None, :]
    low, high, best = low[..., None], high[..., None], best[..., None]
    first, last = np.ceil((low - shift - 1e-12) / TURN), np.floor((high - shift + 1e-12) / TURN)
    turns = np.clip(np.round((best - shift) / TURN), first, np.maximum(first, last))
    inside = np.minimum(np.maximum(low - shift - TURN * turns, shift + TURN * turns - high), pi)
    out = np.sum(np.where(first <= last, 0.0, np.maximum(inside, 1e-9)), axis=-2)
    miss = shift + TURN * turns - best
    cost = np.einsum("...jk,j->...k", miss**2, heavy)
    free = tried - np.einsum("...jk,j->...k", miss, heavy) / max(float(np.sum(heavy)), 1e-300)
    least, most = np.max(low - TURN * turns, axis=-2), np.min(high - TURN * turns, axis=-2)
    return cost, out, np.where(least <= most, np.clip(free, least, np.maximum(least, most)), 0.5 * (least + most))


def _as_given(task: OwnTask, joints: Floats, yaw: Floats) -> tuple[Floats, Floats]:
    """Turn joint 1 back by a yaw that is given, segment by segment by whole turns into the limits."""
    yaw = np.broadcast_to(yaw, joints.shape[:2])
    joints[..., 0] -= task.sense * yaw[..., None]
    beyond = np.zeros(joints.shape[:2])
    for segment in task.segments:
        beyond += _lift(task, joints, segment, 0)
    base = task.arm.base
    if not base.yaw_free:
        turn = np.round((yaw - base.yaw.middle) / TURN)
        beyond = beyond + np.maximum(np.abs(yaw - turn * TURN - base.yaw.middle) - 0.5 * base.yaw.width - 1e-9, 0.0)
    return yaw, beyond


def conditioning(task: OwnTask, joints: Floats) -> Floats:
    """(..., m) σmin/σmax of the Jacobian of the TCP, linear rows over the characteristic length."""
    arm, own = task.arm, task.own
    tcp = own.hand @ arm.tool
    flat = joints.reshape(-1, 6)
    columns = np.empty((len(flat), 6, 6))
    point = np.broadcast_to(tcp[:3, 3], (len(flat), 3))
    # from the last joint inwards, everything in the axes that joint i leaves: a common turn changes no singular value
    for i in range(5, -1, -1):
        columns[:, 3:, i] = own.axes[i]
        columns[:, :3, i] = np.cross(own.axes[i], point - own.points[i])
        turn = _about(own.axes[i], flat[:, i])
        point = np.einsum("kij,kj->ki", turn, point - own.points[i]) + own.points[i]
        columns[:, :3, i:] = turn @ columns[:, :3, i:]
        columns[:, 3:, i:] = turn @ columns[:, 3:, i:]
    columns[:, :3] /= characteristic_length(arm.robot)
    values = np.linalg.svd(columns, compute_uv=False)
    ratio: Floats = (values[:, -1] / values[:, 0]).reshape(joints.shape[:-1])
    return ratio


def _about(axis: Floats, angle: Floats) -> Floats:
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    made: Floats = np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)
    return made
