"""The rule that makes a working reference where mid-range is singular."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.catalogue import catalogue
from duocell.models.catalogue.reference import SINGULAR, mid_range, working_reference
from duocell.models.kinematics.kinematics import characteristic_length, conditioning


def test_mid_range_is_zero_for_joints_without_end() -> None:
    lower, upper = np.array([-1.0, -np.inf, -np.inf, 0.5]), np.array([3.0, np.inf, 2.0, 1.0])
    assert np.array_equal(mid_range(lower, upper), [1.0, 0.0, 0.0, 0.75])


def test_regular_mid_range_is_kept() -> None:
    robot = catalogue.robot("franka_panda")
    reference, reason = working_reference(robot)
    assert np.array_equal(reference, mid_range(robot.lower, robot.upper))
    assert reason == "mid-range"


@pytest.mark.parametrize("name", ["ur10e", "irb120", "iiwa14", "jaco2", "fanuc_crx10ia"])
def test_singular_mid_range_is_left_by_few_joints_and_half_way_at_most(name: str) -> None:
    robot = catalogue.robot(name)
    middle = mid_range(robot.lower, robot.upper)
    length = characteristic_length(robot)
    assert conditioning(robot, np.eye(4), middle, length)[0] < SINGULAR
    reference, reason = working_reference(robot)
    moved = np.flatnonzero(reference != middle)
    assert 1 <= len(moved) <= 2
    assert {0, robot.dof - 1}.isdisjoint(moved)
    assert np.all(np.abs(reference - middle) <= np.minimum(0.25 * (robot.upper - robot.lower), np.pi / 2) + 1e-12)
    assert conditioning(robot, np.eye(4), reference, length)[0] > 0.1
    assert all(robot.joint_names[i] in reason for i in moved)


def test_universal_robot_bends_elbow_and_second_wrist_by_the_rule_too() -> None:
    reference, _ = working_reference(catalogue.robot("ur10e"))
    assert np.allclose(np.abs(np.degrees(reference)), [0, 0, 90, 0, 90, 0])


def test_narrow_limits_keep_the_reference_inside() -> None:
    robot = catalogue.robot("ur5e")
    narrow = replace(robot, lower=np.full(6, -0.4), upper=np.full(6, 0.4))
    reference, _ = working_reference(narrow)
    assert np.abs(reference).max() == pytest.approx(0.2)
