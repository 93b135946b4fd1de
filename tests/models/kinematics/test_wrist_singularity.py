"""The distance of a wrist from its singularity, against the rank of the Jacobian, and what the rule asks for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.kept import KEPT
from duocell.models.kinematics.kinematics import characteristic_length, conditioning
from duocell.models.kinematics.wrist_singularity import wrist_distance, wrist_shortfall
from duocell.models.robot.arm import SINGULAR_WRIST
from duocell.models.robot.robot import Robot
from tests.support.given.arms import form_of, make_arm, oblique_wrist, random_joints


@pytest.mark.parametrize("robot", ["puma560", "ur10e", oblique_wrist()], ids=["puma560", "ur10e", "oblique"])
def test_the_jacobian_loses_rank_where_the_distance_is_zero(robot: str | Robot) -> None:
    arm = make_arm(robot)
    form = form_of(arm.robot)
    joints = random_joints(arm, 40, np.random.default_rng(0))
    length = characteristic_length(arm.robot)
    for turn in (0.0, np.pi, -np.pi, 3.0 * np.pi):
        joints[:, 4] = form.wrist_zero + turn
        assert np.max(wrist_distance(form.wrist_zero, joints[:, 4])) < 1e-12
        assert np.max(conditioning(arm.robot, arm.tool, joints, length)) < 1e-9


@pytest.mark.parametrize("name", ["puma560", "ur10e"])
def test_the_distance_is_the_angle_whose_sine_is_the_wrist_term(name: str) -> None:
    form = form_of(make_arm(name).robot)
    fifth = np.random.default_rng(1).uniform(-12.0, 12.0, (4, 50))
    np.testing.assert_allclose(
        wrist_distance(form.wrist_zero, fifth), np.arcsin(np.abs(np.sin(fifth - form.wrist_zero))), atol=1e-7
    )


@pytest.mark.parametrize(
    ("distance", "short"),
    [(0.0, True), (SINGULAR_WRIST - 2.0 * KEPT, True), (SINGULAR_WRIST - 0.5 * KEPT, False), (0.3, False)],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_rule_counts_the_nearest_pose_and_only_where_it_is_in_force(
    distance: float, short: bool, side: float
) -> None:
    arm = make_arm("ur10e")
    path = np.full((6, 3, 4), 0.7)
    path[4, 1, 2] = form_of(arm.robot).wrist_zero + np.pi + side * distance
    shortfall = wrist_shortfall(arm, path)
    expected = max(SINGULAR_WRIST - KEPT - distance, 0.0)
    np.testing.assert_allclose(shortfall, [0.0, expected, 0.0], atol=1e-12)
    assert (shortfall[1] > 0.0) == short
    assert not np.any(wrist_shortfall(replace(arm, avoid_singularities=False), path))


def test_arms_without_a_closed_form_have_no_such_rule() -> None:
    assert np.array_equal(wrist_shortfall(make_arm("iiwa14"), np.zeros((7, 2, 3))), np.zeros(2))
