"""The witness of a possible task as the optimizer writes a solution down."""

from __future__ import annotations

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.branches import posture_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.posture import Posture, Signs
from duocell.models.robot.robot import Robot
from duocell.optimizer.nlp.program import ArmSolution
from tests.support.given.tasks import Possible
from tests.support.present import present


def signs_at(robot: Robot, joints: Floats) -> Signs | None:
    """The posture of joint values (n,) [rad]; None for robots without postures."""
    form = closed_form(robot)
    return None if form is None else posture_of(form, joints)


def posture_of_witness(task: Possible) -> Posture:
    """What the arm has to be asked for if it is to do the task as its witness does."""
    return Posture(*present(signs_at(task.arm.robot, task.joints[0])))


def witness_of(task: Possible) -> ArmSolution:
    """Base and joints that do the task."""
    return ArmSolution(task.position, task.yaw, task.joints, signs_at(task.arm.robot, task.joints[0]))
