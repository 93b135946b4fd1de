"""The way between the poses in even steps, followed by Pinocchio and Newton's method: plain, slow, on its own.

Nothing here comes from `duocell.optimizer.clearance.path_samples` or `duocell.optimizer.clearance.motion`: it is what
their answers are held against.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
import pinocchio as pin

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.kinematics import FLANGE, pinocchio_model
from duocell.models.robot.arm import Arm

REACHED = 1e-10
"""Length of a twist (m and rad) at which Newton's method has arrived."""
ITERATIONS = 30
ARRIVED = 5e-3
"""rad; how near the followed joints must come to those given at the next pose: another branch is farther away. In a
singularity joints are free to share a turn as they like: in cell 29 of `bench.draws.cells`, whose best layout begins a
way with a straight wrist, they do so by 2 mrad other than where the way before ends, however short the steps are."""
DAMPING = 1e-9
"""Squared; only felt where the Jacobian is all but singular."""


@dataclass(frozen=True, eq=False)
class ObjectSteps:
    """Samples of the object's path.

    Attributes:
        poses: (K, 4, 4) in the world.
        step: (K,) number of the pose before. fraction: (K,) of the way to the next one; 0 at the poses themselves.
    """

    poses: Floats
    step: np.ndarray[tuple[int], np.dtype[np.int64]]
    fraction: Floats


@dataclass(frozen=True, slots=True)
class Lost:
    """An arm does not get to the next pose's joints: where, and how far it is off [rad, or m and rad of the hand]."""

    arm: str
    pose: int
    fraction: float
    off: float


def object_steps(poses: Floats, length: float, angle: float) -> ObjectSteps:
    """Straight from pose to pose, turning the short way at constant speed, ends included.

    Args:
        poses: (m, 4, 4).
        length: m, longest step. angle: rad, largest turn of a step.
    """
    sampled, step, fraction = [], [], []
    for k in range(len(poses) - 1):
        start, end = poses[k], poses[k + 1]
        shift, turn = end[:3, 3] - start[:3, 3], pin.log3(start[:3, :3].T @ end[:3, :3])
        count = max(1, ceil(np.linalg.norm(shift) / length), ceil(np.linalg.norm(turn) / angle))
        for i in range(count):
            pose = np.eye(4)
            pose[:3, :3] = start[:3, :3] @ pin.exp3(i / count * turn)
            pose[:3, 3] = start[:3, 3] + i / count * shift
            sampled.append(pose)
            step.append(k)
            fraction.append(i / count)
    sampled.append(poses[-1])
    step.append(len(poses) - 1)
    fraction.append(0.0)
    return ObjectSteps(np.array(sampled), np.array(step), np.array(fraction))


def follow(arm: Arm, base: Floats, steps: ObjectSteps, joints: Floats) -> tuple[Floats, Lost | None]:
    """The joints of one arm along the path, each sample from the one before it.

    Args:
        arm: six joints (more would leave a choice between the poses).
        base: (4, 4) in the world.
        steps: samples of the object.
        joints: (m, 6) rad at the poses; every stretch begins there and must end at the next row.

    Returns:
        (K, 6) rad, and the first place where the arm gets lost; what follows that place is not to be trusted.
    """
    if arm.dof != 6:
        raise ValueError(f"{arm.name} has {arm.dof} joints; between the poses only six leave no choice")
    model = pinocchio_model(arm.robot)
    data, frame = model.createData(), model.getFrameId(FLANGE)
    to_base, to_flange = np.linalg.inv(base), np.linalg.inv(arm.tool)
    rows: Floats = np.empty((len(steps.poses), 6))
    lost: Lost | None = None
    q, before = joints[0], joints[0]
    for k, pose in enumerate(steps.poses):
        at_pose = steps.fraction[k] == 0.0
        guess = 2.0 * q - before if k and not at_pose else q
        target = pin.SE3(to_base @ pose @ arm.grasp @ to_flange)
        before = q
        q, off = _newton(model, data, frame, target, guess)
        if at_pose:
            off = max(off, float(np.max(np.abs(q - joints[steps.step[k]]))))
            before = q = joints[steps.step[k]]
        if lost is None and off > (ARRIVED if at_pose else 1e3 * REACHED):
            lost = Lost(arm.name, int(steps.step[k]), float(steps.fraction[k]), off)
        rows[k] = q
    return rows, lost


def _newton(model: Any, data: Any, frame: int, target: pin.SE3, q: Floats) -> tuple[Floats, float]:
    """Joints that take the flange to ``target``, and the length of the twist that is left."""
    left = np.inf
    for _ in range(ITERATIONS):
        pin.framesForwardKinematics(model, data, q)
        error = pin.log6(data.oMf[frame].actInv(target)).vector
        left = float(np.linalg.norm(error))
        if left < REACHED:
            break
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.ReferenceFrame.LOCAL)
        q = q + jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + DAMPING * min(left, 1.0) * np.eye(6), error)
    return q, left
