"""The independent check finds what is wrong with a point, and by how much."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, rotation_x
from duocell.models.cell.task import Task
from duocell.models.robot.posture import signs_from
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.verify import check, summarise
from tests.support.given.fields import ArmFields
from tests.support.given.tasks import Possible, possible
from tests.support.given.witness import witness_of
from tests.support.present import present


def witness(name: str = "puma560", **given: Unpack[ArmFields]) -> tuple[Possible, ArmSolution]:
    task = possible(name, np.random.default_rng(8), half=(0.3, 0.3, 0.2, 0.5), **given)
    return task, witness_of(task)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "iiwa14", "gen3"])
@pytest.mark.parametrize("mount", [np.eye(3), rotation_x(2.0)], ids=["floor", "wall"])
def test_a_witness_passes(name: str, mount: Floats) -> None:
    task, point = witness(name, mount=mount)
    found = check(task.cell, task.arm, point)
    assert found.usable
    assert found.position_error < 1e-9
    assert found.orientation_error < 1e-9
    assert found.limits <= 0.0
    assert found.joint_step == np.abs(np.diff(point.joints, axis=0)).max()


def test_wrong_positions_and_orientations_are_measured() -> None:
    task, point = witness()
    poses = task.cell.task.poses.copy()
    poses[2, :3, 3] += [0.0, 3e-6, 4e-6]
    poses[3, :3, :3] = rotation_about([0.6, 0.0, 0.8], 2e-5) @ poses[3, :3, :3]
    found = check(replace(task.cell, task=Task(poses)), task.arm, point)
    assert found.position_error == pytest.approx(5e-6, rel=1e-6)
    assert found.orientation_error == pytest.approx(2e-5, rel=1e-6)
    assert not found.usable


def test_half_a_turn_is_an_error_of_half_a_turn() -> None:
    task, point = witness()
    poses = task.cell.task.poses.copy()
    poses[0, :3, :3] = poses[0, :3, :3] @ np.diag([1.0, -1.0, -1.0])
    found = check(replace(task.cell, task=Task(poses)), task.arm, point)
    assert found.orientation_error == pytest.approx(np.pi, abs=1e-6)


def test_limits_of_joints_and_base_are_measured() -> None:
    task, point = witness()
    upper = task.arm.upper.copy()
    upper[3] = point.joints[:, 3].max() - 0.01
    assert check(task.cell, replace(task.arm, upper=upper), point).limits == pytest.approx(0.01)
    shifted = replace(task.arm.base, y=replace(task.arm.base.y, high=point.position[1] - 0.02))
    assert check(task.cell, replace(task.arm, base=shifted), point).limits == pytest.approx(0.02)


def test_a_yaw_outside_the_region_is_not_usable() -> None:
    """Whatever turn it is counted in."""
    task, point = witness()
    for turn in (-2.0 * np.pi, 0.0, 2.0 * np.pi):
        low = point.yaw + turn + 0.03
        arm = replace(task.arm, base=replace(task.arm.base, yaw=replace(task.arm.base.yaw, low=low, high=low + 0.5)))
        assert not check(task.cell, arm, point).usable
        fits = replace(arm, base=replace(arm.base, yaw=replace(arm.base.yaw, low=low - 0.1, high=low)))
        assert check(task.cell, fits, point).usable


def test_a_turn_hidden_in_a_step_is_not_usable() -> None:
    task, point = witness("ur10e")
    joints = point.joints.copy()
    joints[3:, 5] += 2.0 * np.pi * (1 if joints[:, 5].max() < 0 else -1)
    found = check(task.cell, task.arm, replace(point, joints=joints))
    assert found.position_error < 1e-9  # the flange does not see it
    assert found.joint_step > 4.0
    assert not found.usable


def test_another_posture_than_the_one_claimed_is_not_usable() -> None:
    task, point = witness()
    for k in range(3):
        signs = signs_from(-s if i == k else s for i, s in enumerate(present(point.signs)))
        found = check(task.cell, task.arm, replace(point, signs=signs))
        assert found.posture > 1e-3
        assert not found.usable


def test_a_posture_that_changes_on_the_way_is_not_usable() -> None:
    task, point = witness()
    joints = point.joints.copy()
    joints[2, 4] = -joints[2, 4]
    assert check(task.cell, task.arm, replace(point, joints=joints)).posture > 1e-3


def test_conditioning_that_is_asked_for_is_checked() -> None:
    task, point = witness()
    assert check(task.cell, replace(task.arm, min_conditioning=1e-3), point).usable
    found = check(task.cell, replace(task.arm, min_conditioning=0.9), point)
    assert found.conditioning > 0.5
    assert not found.usable


def test_the_summary_is_the_worst_of_all_arms() -> None:
    task, point = witness()
    good = check(task.cell, task.arm, point)
    bad = replace(good, position_error=1.0, limits=0.5)
    worst = summarise([good, bad, replace(good, orientation_error=2.0, joint_step=3.0)])
    assert (worst.max_position_error, worst.max_orientation_error, worst.max_joint_step) == (1.0, 2.0, 3.0)
    assert worst.limits_respected is False
    assert summarise([good]).limits_respected is True
