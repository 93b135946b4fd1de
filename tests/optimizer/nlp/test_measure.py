"""The figures of a placement, each against its definition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import path_signs, signs_of
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import name_signs
from duocell.optimizer.nlp.measure import joint_margins, objective_of, placed
from duocell.optimizer.nlp.program import ArmSolution
from tests.support.given.arms import form_of, make_arm, region
from tests.support.given.tasks import possible
from tests.support.oracles.answers import assert_placed, conditioning_by_differences
from tests.support.oracles.signs import joint_axes


def at_rest(arm: Arm, count: int) -> Cell:
    """A cell whose object never moves."""
    return Cell(Task(np.tile(np.eye(4), (count, 1, 1))), (arm,))


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900", "iiwa14", "ur3e", "yumi_left"])
def test_figures_of_the_witness_are_those_of_its_joints(name: str) -> None:
    task = possible(name, np.random.default_rng(3), tool=transform(rotation_z(0.2), [0.1, 0.05, 0.1]))
    assert_placed(task.cell, task.arm, placed(task.cell, task.arm, ArmSolution(task.position, task.yaw, task.joints)))


def test_margins_are_infinite_for_endless_joints() -> None:
    arm = make_arm("ur3e")
    margins = joint_margins(arm, np.zeros((3, 6)) + 0.1)
    assert margins[5] == np.inf
    assert margins[0] == pytest.approx(2.0 * np.pi - 0.1)
    free = replace(arm, lower=np.full(6, -np.inf), upper=np.full(6, np.inf))
    assert placed(at_rest(free, 2), free, ArmSolution(np.zeros(3), 0.0, np.full((2, 6), 0.3))).minimum_margin == np.inf


def test_margins_are_negative_beyond_a_limit() -> None:
    arm = make_arm("puma560")
    joints = np.array([arm.upper + 0.2, arm.lower])
    assert joint_margins(arm, joints) == pytest.approx(np.full(6, -0.2))


def test_objective_is_a_sum_not_a_mean() -> None:
    arm = make_arm("puma560", weights=np.arange(6.0), reference=np.zeros(6))
    assert objective_of(at_rest(arm, 10), arm, np.ones((10, 6))) == 10 * 15.0


def test_signs_of_a_path_ignore_where_it_touches_zero() -> None:
    arm = make_arm("puma560")
    form = form_of(arm.robot)
    bent = np.array([0.2, -0.6, 2.4, 0.3, -0.5, 0.1])
    straight = bent.copy()
    straight[4] = 0.0
    expected = tuple(int(s) for s in signs_of(form, bent))
    assert path_signs(form, np.array([straight, bent, straight])) == expected
    placement = placed(at_rest(arm, 2), arm, ArmSolution(np.zeros(3), 0.0, np.array([straight, bent])))
    assert placement.posture == name_signs(expected)
    assert placement.singularity_distances["wrist"] == pytest.approx(0.0, abs=1e-12)
    assert placement.minimum_conditioning < 1e-9


def test_distances_to_singularities_are_angles_and_metres() -> None:
    """Of the PUMA: θ5, the bend between upper arm and forearm, the wrist's way in front of axis 1."""
    arm = make_arm("puma560")
    q = np.array([0.4, -0.7, 2.2, 0.3, -0.6, 0.1])
    found = placed(at_rest(arm, 1), arm, ArmSolution(np.zeros(3), 0.0, q[None])).singularity_distances
    axes, points = joint_axes(arm.robot, q[None])
    wrist, shoulder, elbow = points[4, 0], points[1, 0], points[2, 0]
    across = axes[1, 0]
    upper, fore = (link - across * (across @ link) for link in (elbow - shoulder, wrist - elbow))
    bend = np.arccos(upper @ fore / np.linalg.norm(upper) / np.linalg.norm(fore))
    assert found["wrist"] == pytest.approx(0.6)
    assert found["elbow"] == pytest.approx(min(bend, np.pi - bend))
    assert found["shoulder"] == pytest.approx(abs(np.cross(axes[0, 0], wrist) @ across))


def test_yaw_is_reported_inside_the_interval_and_conditioning_with_the_tool() -> None:
    arm = make_arm("ur5e", base=region(yaw=(3.0, 4.0)), tool=transform(np.eye(3), [0.0, 0.2, 0.3]))
    q = np.array([0.3, -1.0, 1.2, -1.0, -1.3, 0.4])
    placement = placed(at_rest(arm, 1), arm, ArmSolution(np.zeros(3), 3.5 - 4.0 * np.pi, q[None]))
    assert placement.yaw == pytest.approx(3.5)
    length = placement.characteristic_length
    assert placement.minimum_conditioning == pytest.approx(conditioning_by_differences(arm, q, length), abs=1e-6)
    bare = placed(at_rest(arm, 1), replace(arm, tool=np.eye(4)), ArmSolution(np.zeros(3), 3.5, q[None]))
    assert bare.characteristic_length == length
    assert bare.minimum_conditioning != pytest.approx(placement.minimum_conditioning, rel=1e-3)
