"""Pinocchio's side of every robot: poses, Jacobians, conditioning, lengths and reach."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, pi, sqrt

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_from_rpy, rotation_vector, transform
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.dh import DhRow, robot_from_dh
from duocell.models.kinematics.kinematics import (
    FLANGE,
    characteristic_length,
    conditioning,
    flange_poses,
    jacobians,
    pinocchio_model,
    reach,
    reach_sphere,
)
from duocell.models.robot.robot import Robot

TOOL = transform(rotation_from_rpy((0.3, -0.2, 1.0)), [0.05, -0.02, 0.12])


def random_joints(robot: Robot, count: int, seed: int = 0) -> Floats:
    return np.random.default_rng(seed).uniform(-pi, pi, (count, robot.dof))


def numeric_jacobian(robot: Robot, q: Floats, tool: Floats, step: float = 1e-6) -> Floats:
    """Central differences of the TCP pose: position over rotation vector, in base axes."""
    moved = np.concatenate([q + step * np.eye(robot.dof), q - step * np.eye(robot.dof)])
    ahead, behind = np.split(flange_poses(robot, moved) @ tool, 2)
    linear = ahead[:, :3, 3] - behind[:, :3, 3]
    angular = rotation_vector(ahead[:, :3, :3] @ np.swapaxes(behind[:, :3, :3], 1, 2))
    return np.concatenate([linear, angular], axis=1).T / (2.0 * step)


@pytest.mark.parametrize("name", catalogue.names())
def test_jacobian_is_the_derivative_of_the_tool_pose(name: str) -> None:
    robot = catalogue.robot(name)
    joints = random_joints(robot, 3)
    for q, jacobian in zip(joints, jacobians(robot, joints, TOOL), strict=True):
        assert np.allclose(jacobian, numeric_jacobian(robot, q, TOOL), rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("name", catalogue.names())
def test_flange_never_leaves_its_reach(name: str) -> None:
    robot = catalogue.robot(name)
    positions = flange_poses(robot, random_joints(robot, 1000))[:, :3, 3]
    centre, radius = reach_sphere(robot)
    from_base = float(np.linalg.norm(positions, axis=1).max())
    from_centre = float(np.linalg.norm(positions - centre, axis=1).max())
    assert 0.85 * reach(robot) < from_base <= reach(robot) + 1e-12
    assert 0.85 * radius < from_centre <= radius + 1e-12


def test_centre_of_the_reach_lies_on_the_first_axis() -> None:
    robot = catalogue.robot("yumi_left")
    centre, _ = reach_sphere(robot)
    turned = robot.joint_placements[0]
    offset = centre - turned[:3, 3]
    assert np.linalg.norm(np.cross(offset, turned[:3, :3] @ robot.joint_axes[0])) < 1e-12


def test_reach_of_the_puma_is_close_to_the_exact_value_of_the_source() -> None:
    a2, a3, d2, d4, d6 = 0.4318, 0.0203, 0.1491, 0.4331, 0.0563
    exact = sqrt(d2**2 + (a2 + hypot(a3, d4 + d6)) ** 2)  # (5.6)
    assert exact <= reach(catalogue.robot("puma560")) <= 1.02 * exact


def test_conditioning_vanishes_at_the_wrist_singularity() -> None:
    robot = catalogue.robot("puma560")
    q = np.array([[0.3, -0.5, 2.0, 0.4, 0.0, 0.2], [0.3, -0.5, 2.0, 0.4, 1.0, 0.2]])
    singular, bent = conditioning(robot, np.eye(4), q, characteristic_length(robot))
    assert singular < 1e-12
    assert bent > 0.05


def test_conditioning_is_that_of_the_scaled_jacobian() -> None:
    robot = catalogue.robot("iiwa14")
    q = random_joints(robot, 5)
    scaled = jacobians(robot, q, TOOL) * np.array([2.0, 2.0, 2.0, 1.0, 1.0, 1.0])[:, None]
    expected = [1.0 / np.linalg.cond(jacobian) for jacobian in scaled]
    assert np.allclose(conditioning(robot, TOOL, q, 0.5), expected, rtol=1e-12)


def test_conditioning_does_not_depend_on_the_first_joint_or_the_units_of_length() -> None:
    rows = [DhRow(0.7 * i - 2.0, 0.1 * i, 0.3 - 0.1 * i, -3.0, 3.0) for i in range(6)]
    small, large = (
        robot_from_dh("arm", [replace(row, a=size * row.a, d=size * row.d) for row in rows]) for size in (1.0, 10.0)
    )
    q = random_joints(small, 4)
    turned = q + np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    here = conditioning(small, np.eye(4), q, characteristic_length(small))
    assert np.allclose(here, conditioning(small, np.eye(4), turned, characteristic_length(small)), rtol=1e-9)
    assert np.allclose(here, conditioning(large, np.eye(4), q, characteristic_length(large)), rtol=1e-9)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "iiwa14", "yumi_left"])
def test_characteristic_length_balances_both_halves_of_the_jacobian(name: str) -> None:
    robot = catalogue.robot(name)
    length = characteristic_length(robot)
    rows = jacobians(robot, random_joints(robot, 4000), np.eye(4))
    linear = float(np.mean(np.sum(rows[:, :3] ** 2, axis=(1, 2)))) / length**2
    angular = float(np.mean(np.sum(rows[:, 3:] ** 2, axis=(1, 2))))
    assert angular == pytest.approx(robot.dof)
    assert linear == pytest.approx(angular, rel=0.03)


def test_robots_of_one_geometry_share_a_model() -> None:
    robot = catalogue.robot("ur5e")
    narrow = replace(robot, name="narrow", lower=0.1 * robot.lower, upper=0.1 * robot.upper)
    assert pinocchio_model(narrow) is pinocchio_model(robot)
    assert pinocchio_model(catalogue.robot("ur10e")) is not pinocchio_model(robot)
    assert pinocchio_model(robot).existFrame(FLANGE)


def test_one_row_of_joints_counts_as_a_stack_of_one() -> None:
    robot = catalogue.robot("puma560")
    q = random_joints(robot, 1)
    assert np.array_equal(flange_poses(robot, q[0]), flange_poses(robot, q))
    assert jacobians(robot, q[0], TOOL).shape == (1, 6, 6)


@pytest.mark.parametrize("shape", [(2, 7), (5,), (2, 2, 6)])
def test_wrong_number_of_joints_is_a_programming_error(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="expected joint values"):
        flange_poses(catalogue.robot("puma560"), np.zeros(shape))


def test_no_joint_rows_give_no_poses() -> None:
    assert flange_poses(catalogue.robot("puma560"), np.zeros((0, 6))).shape == (0, 4, 4)
