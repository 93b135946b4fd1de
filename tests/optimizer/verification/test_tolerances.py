"""Displacements taken apart again, and hands that are outside of what is open."""

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.freedom import Frame
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.tolerances import parameters_of, tolerance_excess
from tests.models.cell.test_pose_freedom import M, cell_of, freedom


def drawn(seed: int, width: int) -> Floats:
    return np.random.default_rng(seed).uniform(-0.3, 0.3, (M, width))


def test_a_box_is_taken_apart_as_it_was_put_together() -> None:
    cell, arm = cell_of(freedom(dict.fromkeys((0, 1, 2, 5, 6, 7), (-1.0, 1.0)), Frame.TOOL, np.eye(3)))
    asked, values = cell.freedom(arm), drawn(1, 6)
    found = parameters_of(asked, asked.targets(values))
    assert np.allclose(found[:, [0, 1, 2, 5, 6, 7]], values, atol=1e-12)


def test_a_cone_is_the_angle_of_its_axis_and_the_roll_what_is_left() -> None:
    cell, arm = cell_of(freedom({3: (-0.5, 0.5), 4: (-0.5, 0.5), 7: (-1.0, 1.0)}, Frame.PART, np.eye(3), cone=0.5))
    asked, values = cell.freedom(arm), drawn(2, 3)
    found = parameters_of(asked, asked.targets(values))
    shares = values[:, :2] / 0.5
    disc = np.sqrt(1.0 - (1.0 - shares[:, 0] ** 2) * (1.0 - shares[:, 1] ** 2))
    assert np.allclose(found[:, 3], 2.0 * np.arcsin(disc * np.sin(0.25)), atol=1e-12)
    assert np.allclose(found[:, 7], values[:, 2], atol=1e-12)


@pytest.mark.parametrize(("beyond", "index"), [(0.01, 0), (0.02, 7)])
def test_a_hand_outside_is_outside_by_as_much(beyond: float, index: int) -> None:
    wide = freedom({0: (-1.0, 1.0), 7: (-1.0, 1.0)}, Frame.TOOL, np.eye(3))
    cell, arm = cell_of(wide)
    joints = np.tile([0.1, -0.6, 2.0, 0.3, 0.8, -0.2], (M, 1))
    place = ArmSolution(np.zeros(3), 0.0, joints)
    grasps = inverse(cell.task.poses) @ flange_poses(arm.robot, joints) @ arm.tool
    there = replace(arm, grasp=grasps[0])
    still = replace(cell, task=replace(cell.task, poses=np.tile(cell.task.poses[0], (M, 1, 1))), arms=(there,))
    assert tolerance_excess(still, there, place) == pytest.approx(0.0, abs=1e-12)
    lower, upper = wide.lower.copy(), wide.upper.copy()
    lower[2, index], upper[2, index] = beyond, 0.5  # at one pose the hand had to be displaced at least so much
    narrow = replace(there, freedom=replace(wide, lower=lower, upper=upper))
    assert tolerance_excess(replace(still, arms=(narrow,)), narrow, place) == pytest.approx(beyond, abs=1e-9)
