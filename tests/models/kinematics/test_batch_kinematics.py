"""Vectorised kinematics from screw axes against Pinocchio."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from duocell.models.base.pose import rotation_from_rpy, transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.batch_kinematics import conditioning_of, forward_and_jacobian, pose_error
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses, jacobians
from duocell.models.robot.robot import Robot
from tests.support.given.arms import general_six, oblique_wrist, puma_by_table

TOOL = transform(rotation_from_rpy((0.4, -0.3, 1.1)), [0.06, -0.03, 0.15])
ROBOTS = [catalogue.robot(name) for name in catalogue.names()] + [general_six(), oblique_wrist(), puma_by_table()]


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_poses_jacobians_and_conditioning_are_those_of_pinocchio(robot: Robot) -> None:
    q = np.random.default_rng(9).uniform(-2 * pi, 2 * pi, (10, robot.dof))
    rotations, positions, jacobian = forward_and_jacobian(chain_of(robot), q)
    assert np.abs(transform(rotations, positions) - flange_poses(robot, q)).max() < 1e-12
    assert np.abs(jacobian - jacobians(robot, q, np.eye(4))).max() < 1e-12
    length = characteristic_length(robot)
    ours = conditioning_of(chain_of(robot), TOOL, q, length)
    assert np.allclose(ours, conditioning(robot, TOOL, q, length), rtol=0.0, atol=1e-12)


ANGLE = st.floats(0.0, pi - 1e-6)
AXIS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: np.linalg.norm(a) > 0.1)


@given(ANGLE, AXIS, AXIS)
def test_pose_error_is_the_rotation_vector_to_the_target(
    angle: float, axis: tuple[float, float, float], other: tuple[float, float, float]
) -> None:
    vector = angle * np.array(axis) / np.linalg.norm(axis)
    here = Rotation.from_rotvec(other).as_matrix()
    target = transform(Rotation.from_rotvec(vector).as_matrix() @ here, [1.0, 2.0, 3.0])
    error = pose_error(here[None], np.array([[0.5, 0.5, 0.5]]), target)[0]
    assert error[:3] == pytest.approx([0.5, 1.5, 2.5])
    assert np.allclose(error[3:], vector, rtol=0.0, atol=1e-7)


def test_pose_error_takes_one_target_for_all_or_one_each() -> None:
    robot = catalogue.robot("ur5e")
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (4, 6))
    rotations, positions, _ = forward_and_jacobian(chain_of(robot), q)
    targets = flange_poses(robot, q[::-1])
    each = pose_error(rotations, positions, targets)
    for k, target in enumerate(targets):
        assert np.allclose(each[k], pose_error(rotations, positions, target)[k], rtol=0.0, atol=1e-14)
    assert np.abs(pose_error(rotations, positions, targets[::-1])).max() < 1e-12
