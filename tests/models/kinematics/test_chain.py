"""The chain at its zero position: axes as lines, the sense of joint 1, where lines meet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, rotation_x, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.chain import chain_of, meeting_point, parallel
from duocell.models.kinematics.kinematics import flange_poses


def screw(axis: Floats, point: Floats) -> Floats:
    """(4, 4) twist of a unit rotation about a line."""
    cross = np.cross(axis, np.eye(3)).T
    twist = np.zeros((4, 4))
    twist[:3, :3], twist[:3, 3] = cross, -np.cross(axis, point)
    return twist


@pytest.mark.parametrize("name", catalogue.names())
def test_product_of_exponentials_is_the_flange(name: str) -> None:
    robot = catalogue.robot(name)
    chain = chain_of(robot)
    for q in np.random.default_rng(0).uniform(-3.0, 3.0, (3, robot.dof)):
        pose = np.eye(4)
        for axis, point, angle in zip(chain.axes, chain.points, q, strict=True):
            pose = pose @ expm(screw(axis, point) * angle)
        assert np.abs(pose @ chain.home - flange_poses(robot, q)[0]).max() < 1e-12


@pytest.mark.parametrize("name", catalogue.names())
def test_vertical_sign_says_how_a_base_yaw_shifts_joint_1(name: str) -> None:
    robot = catalogue.robot(name)
    sigma = chain_of(robot).vertical_sign
    q = np.random.default_rng(1).uniform(-2.0, 2.0, (4, robot.dof))
    shifted = q.copy()
    shifted[:, 0] -= sigma * 0.7
    turned = transform(rotation_z(0.7), np.zeros(3)) @ flange_poses(robot, shifted)
    same = np.abs(turned - flange_poses(robot, q)).max()
    assert same < 1e-7 if sigma else same > 1e-7


@pytest.mark.parametrize(
    ("name", "sigma"), [("puma560", 1), ("ur10e", 1), ("kr6_r900", -1), ("rs007n", -1), ("yumi_left", 0)]
)
def test_known_senses_of_joint_1(name: str, sigma: int) -> None:
    assert chain_of(catalogue.robot(name)).vertical_sign == sigma


def test_an_upright_axis_beside_the_origin_is_not_vertical_through_it() -> None:
    robot = catalogue.robot("ur5e")
    aside = robot.joint_placements.copy()
    aside[0] = transform(np.eye(3), [0.1, 0.0, 0.0]) @ aside[0]
    assert chain_of(replace(robot, joint_placements=aside)).vertical_sign == 0
    tilted = robot.joint_placements.copy()
    tilted[0] = transform(rotation_x(0.01), np.zeros(3)) @ tilted[0]
    assert chain_of(replace(robot, joint_placements=tilted)).vertical_sign == 0


def test_a_first_axis_that_a_file_prints_with_nine_digits_is_still_vertical() -> None:
    robot = catalogue.robot("ur5e")
    tilted = robot.joint_placements.copy()
    tilted[0] = transform(rotation_x(2e-9), [3e-9, 0.0, 0.0]) @ tilted[0]
    rounded = replace(robot, joint_placements=tilted)
    assert chain_of(rounded).vertical_sign == chain_of(robot).vertical_sign == 1
    q = np.random.default_rng(2).uniform(-2.0, 2.0, (4, 6))
    shifted = q - [0.7, 0.0, 0.0, 0.0, 0.0, 0.0]
    turned = transform(rotation_z(0.7), np.zeros(3)) @ flange_poses(rounded, shifted)
    assert np.abs(turned - flange_poses(rounded, q)).max() < 1e-8  # a hundredth of what a layout may miss its poses by


UNIT = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: np.linalg.norm(a) > 0.1)


@given(UNIT, UNIT, st.lists(st.floats(-2.0, 2.0), min_size=5, max_size=5))
def test_lines_through_a_point_meet_there(
    first: tuple[float, float, float], second: tuple[float, float, float], numbers: list[float]
) -> None:
    h = [np.array(v) / np.linalg.norm(v) for v in (first, second)]
    apart = np.linalg.norm(np.cross(*h))
    point, slides = np.array(numbers[:3]), numbers[3:]
    lines = [(point + s * v, v) for s, v in zip(slides, h, strict=True)]
    if apart > 0.05:
        assert not parallel(*h)
        assert meeting_point(lines, 1e-9) == pytest.approx(point, abs=1e-10)
        normal = np.cross(*h) / apart
        assert meeting_point([lines[0], (lines[1][0] + 1e-3 * normal, h[1])], 1e-5) is None


def test_parallel_lines_meet_nowhere() -> None:
    h = np.array([0.0, 0.6, 0.8])
    assert parallel(h, h)
    assert parallel(h, -h)
    assert not parallel(h, rotation_about([1.0, 0.0, 0.0], 1e-3) @ h)
    assert meeting_point([(np.zeros(3), h), (np.array([1.0, 0.0, 0.0]), h)], 1e-7) is None


def test_chain_is_read_only_and_kept() -> None:
    robot = catalogue.robot("iiwa14")
    chain = chain_of(robot)
    assert chain_of(robot) is chain
    with pytest.raises(ValueError, match="read-only"):
        chain.axes[0] = 0.0
    assert np.linalg.norm(chain.axes, axis=1) == pytest.approx(np.ones(7))
    assert chain.home == pytest.approx(flange_poses(robot, np.zeros(7))[0], abs=1e-14)
