"""Three engines, one geometry: CasADi, Pinocchio and ssik agree for every robot of the catalogue."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import casadi as ca
import numpy as np
import pytest
import ssik

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.casadi_kinematics import flange_function
from duocell.models.kinematics.kinematics import flange_poses, jacobians
from duocell.models.robot.robot import Robot


def by_casadi(robot: Robot, joints: Floats) -> Floats:
    function = flange_function(robot)
    return np.array([transform(np.array(r), np.array(p)[:, 0]) for r, p in (function(q) for q in joints)])


def joints_of(robot: Robot, count: int = 20) -> Floats:
    return np.random.default_rng(7).uniform(-2.0 * pi, 2.0 * pi, (count, robot.dof))


@pytest.mark.parametrize("name", catalogue.names())
def test_casadi_agrees_with_pinocchio(name: str) -> None:
    robot = catalogue.robot(name)
    joints = joints_of(robot)
    assert np.abs(by_casadi(robot, joints) - flange_poses(robot, joints)).max() < 1e-14 * (1.0 + robot.dof)


@pytest.mark.parametrize("name", [name for name in catalogue.names() if name != catalogue.SOURCE_PUMA])
def test_pinocchio_agrees_with_ssik(name: str) -> None:
    robot = catalogue.robot(name)
    assert robot.ssik_name is not None
    theirs = ssik.Manipulator.from_prebuilt(robot.ssik_name)
    joints = joints_of(robot)
    expected = np.array([theirs.fk(q) for q in joints])
    assert np.abs(flange_poses(robot, joints) - expected).max() < 1e-9


def test_function_names_its_inputs_and_outputs() -> None:
    function = flange_function(catalogue.robot("iiwa14"))
    assert function.name_in() == ["q"]
    assert function.name_out() == ["R", "p"]
    assert function.size_in("q") == (7, 1)
    assert function.size_out("R") == (3, 3)
    assert function.size_out("p") == (3, 1)


def test_function_is_shared_by_robots_of_one_geometry() -> None:
    robot = catalogue.robot("ur5e")
    assert flange_function(replace(robot, name="other", reference=robot.upper)) is flange_function(robot)
    assert flange_function(catalogue.robot("ur3e")) is not flange_function(robot)


def test_derivative_of_the_position_is_the_linear_half_of_the_jacobian() -> None:
    robot = catalogue.robot("fanuc_crx10ia")
    q = ca.SX.sym("q", robot.dof)
    derivative = ca.Function("derivative", [q], [ca.jacobian(flange_function(robot)(q)[1], q)])
    for row in joints_of(robot, 5):
        assert np.abs(np.array(derivative(row)) - jacobians(robot, row, np.eye(4))[0, :3]).max() < 1e-12


def test_function_maps_over_a_path() -> None:
    robot = catalogue.robot("puma560")
    joints = joints_of(robot, 8)
    rotations, positions = flange_function(robot).map(8)(joints.T)
    assert np.array(rotations).shape == (3, 24)
    assert np.abs(np.array(positions).T - flange_poses(robot, joints)[:, :3, 3]).max() < 1e-13
