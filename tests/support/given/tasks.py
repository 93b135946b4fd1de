"""Tasks that are possible by construction: a random base, random joint values inside the limits, a short way."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.robot import Robot
from tests.support.given.arms import make_arm, random_joints
from tests.support.given.fields import ArmChanges, ArmFields
from tests.support.oracles.signs import axis_signs


@dataclass(frozen=True)
class Possible:
    """A cell of one arm with a witness: base position, yaw and joints that do the task."""

    cell: Cell
    position: Floats
    yaw: float
    joints: Floats

    @property
    def arm(self) -> Arm:
        return self.cell.arms[0]


def possible(
    robot: str | Robot,
    rng: np.random.Generator,
    poses: int = 5,
    step: float = 0.12,
    half: tuple[float, float, float, float] = (0.5, 0.5, 0.0, np.pi),
    max_joint_step: float = np.pi / 2,
    tight: float | None = None,
    **given: Unpack[ArmFields],
) -> Possible:
    """A random possible task.

    Args:
        robot: a name or a robot.
        rng: source of chance.
        poses: length of the path.
        step: rad, typical change of a joint between poses.
        half: half widths of the base region around the true base, x, y, z [m], yaw [rad].
        max_joint_step: rad.
        tight: rad, how far the limits in force are from the witness's path; None for the robot's own.
        given: further fields of the arm.
    """
    arm = make_arm(robot, **given)
    joints = way_of_joints(arm, rng, poses, step)
    if tight is not None:
        lower = np.maximum(arm.lower, joints.min(axis=0) - tight * rng.uniform(0.3, 1.0, arm.dof))
        upper = np.minimum(arm.upper, joints.max(axis=0) + tight * rng.uniform(0.3, 1.0, arm.dof))
        arm = replace(
            arm, lower=lower, upper=upper, weights=range_weights(lower, upper), reference=0.5 * (lower + upper)
        )
    position = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.3, 0.3)])
    yaw = float(rng.uniform(-np.pi, np.pi))
    flange = transform(arm.mount @ rotation_z(yaw), position) @ flange_poses(arm.robot, joints)
    object_in_world = flange @ arm.tool @ inverse(arm.grasp)
    # off the middle, so that the witness is no special point of the region
    centre = np.array([*position, yaw]) + rng.uniform(-0.6, 0.6, 4) * half
    x, y, z, turn = (Interval(float(c - h), float(c + h)) for c, h in zip(centre, half, strict=True))
    base = BaseRegion(x, y, z, FREE_YAW if half[3] >= np.pi else turn)
    arm = replace(arm, base=base)
    return Possible(Cell(Task(object_in_world), (arm,), max_joint_step), position, yaw, joints)


def with_arm(task: Possible, **changes: Unpack[ArmChanges]) -> Cell:
    """The cell of a task, something about its arm changed."""
    return replace(task.cell, arms=(replace(task.arm, **changes),))


def way_of_joints(arm: Arm, rng: np.random.Generator, poses: int, step: float) -> Floats:
    """(poses, n) rad inside the limits, away from singularities, in one posture."""
    length = characteristic_length(arm.robot)
    way = np.linspace(0.0, 1.0, poses)[:, None]
    for _ in range(1000):
        start = random_joints(arm, 1, rng, 0.05)[0]
        bend = rng.normal(size=(2, arm.dof)) * step * (poses - 1)
        path: Floats = start + way * bend[0] + way**2 * 0.3 * bend[1]
        inside = np.all((path > arm.lower + 0.02) & (path < arm.upper - 0.02))
        if not inside or np.min(conditioning(arm.robot, arm.tool, path, length)) < 0.03:
            continue
        dense = np.array([np.interp(np.linspace(0, 1, 60), way[:, 0], path[:, i]) for i in range(arm.dof)]).T
        signs = axis_signs(arm.robot, dense)
        if signs is None or np.all(signs == signs[0]):
            return path
    raise AssertionError(f"no path for {arm.robot.name}")


def upright(robot: Robot) -> bool:
    """True if a base yaw only shifts joint 1."""
    return chain_of(robot).vertical_sign != 0
