"""Task sequences that are possible by construction: several short ways of one arm from one base, in one posture."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np

from duocell.models.base.pose import inverse
from duocell.models.cell.task import Task
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.robot import Robot
from tests.support.given.fields import WitnessFields
from tests.support.given.tasks import Possible, possible, way_of_joints
from tests.support.oracles.signs import axis_signs


def possible_task_sequence(
    robot: str | Robot,
    rng: np.random.Generator,
    segment_weights: tuple[float, ...] = (1.0, 1.0),
    poses: int = 4,
    step: float = 0.12,
    **given: Unpack[WitnessFields],
) -> Possible:
    """A random possible task sequence.

    Args:
        robot: a name or a robot.
        rng: source of chance.
        segment_weights: there are as many segments.
        poses: of each segment. step: rad, typical change of a joint between them.
        given: as for `tests.support.given.tasks.possible`.
    """
    first = possible(robot, rng, poses=poses, step=step, **given)
    arm = first.arm
    signs = axis_signs(arm.robot, first.joints)
    base = arm.base_in_world(first.position, first.yaw)
    ways = [first.joints]
    while len(ways) < len(segment_weights):
        joints = way_of_joints(arm, rng, poses, step)
        if signs is None or np.all(axis_signs(arm.robot, joints) == signs[0]):
            ways.append(joints)
    tasks = [Task(base @ flange_poses(arm.robot, joints) @ arm.tool @ inverse(arm.grasp)) for joints in ways]
    names = "abcdefgh"
    segments = [
        TaskSegment(names[k], task, weight) for k, (task, weight) in enumerate(zip(tasks, segment_weights, strict=True))
    ]
    return replace(first, cell=replace(first.cell, task=task_sequence(segments)), joints=np.concatenate(ways))
