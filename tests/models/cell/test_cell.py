"""Where the flange of an arm has to go."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import inverse, rotation_x, rotation_z, transform
from duocell.models.cell.cell import DEFAULT_MAX_JOINT_STEP, Cell
from duocell.models.cell.task import Task
from tests.support.given.arms import make_arm

POSES = transform(rotation_z(np.array([0.1, 0.7])), np.array([[1.0, 2.0, 3.0], [1.1, 2.1, 3.1]]))


def test_flange_targets_bring_the_tool_to_the_grasp() -> None:
    grasp, tool = transform(rotation_x(0.4), [0.1, 0.2, 0.3]), transform(rotation_z(-1.0), [0.0, 0.1, 0.2])
    arm = make_arm("ur5e", tool=tool, grasp=grasp)
    cell = Cell(Task(POSES), (arm,))
    targets = cell.flange_targets(arm)
    assert targets.shape == (2, 4, 4)
    assert np.allclose(targets @ tool, POSES @ grasp, rtol=0.0, atol=1e-14)
    assert np.allclose(inverse(grasp) @ inverse(POSES) @ targets, inverse(tool), rtol=0.0, atol=1e-14)


def test_without_tool_and_grasp_the_flange_is_the_object() -> None:
    arm = make_arm("ur5e")
    assert np.allclose(Cell(Task(POSES), (arm,)).flange_targets(arm), POSES, rtol=0.0, atol=1e-15)


def test_a_step_is_a_quarter_turn_unless_asked_otherwise() -> None:
    assert Cell(Task(POSES), (make_arm(),)).max_joint_step == DEFAULT_MAX_JOINT_STEP == np.pi / 2


def test_a_base_in_the_world_is_mount_then_yaw() -> None:
    arm = make_arm("ur5e", mount=rotation_x(0.5))
    assert not arm.upright
    assert make_arm("ur5e").upright
    poses = arm.base_in_world(np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]), np.array([0.3, 0.0]))
    assert np.allclose(poses[0], transform(rotation_x(0.5) @ rotation_z(0.3), [1.0, 2.0, 3.0]))
    assert np.allclose(poses[1, :3, :3], rotation_x(0.5))


def test_a_part_of_a_task_sequence_keeps_segments_weights_and_grasps() -> None:
    poses = transform(rotation_z(np.linspace(0.0, 0.5, 6)), np.linspace([1.0, 2.0, 3.0], [1.1, 2.1, 3.1], 6))
    grasps = transform(rotation_x(np.array([0.1, 0.2, 0.3])), np.zeros((3, 3)))
    arm = make_arm("ur5e", grasps=grasps)
    cell = Cell(Task(poses, (0, 2, 4), ("a", "b", "c"), np.arange(6.0)), (arm, make_arm("ur5e", "other")))
    some = cell.part(3, 4)
    assert np.array_equal(some.task.poses, poses[3:5])
    assert (some.task.starts, some.task.names) == ((0, 1), ("b", "c"))
    assert np.array_equal(some.task.weights, [3.0, 4.0])
    assert np.array_equal(some.grasps(some.arms[0]), grasps[1:])
    one = cell.part(2, 2)
    assert (len(one.task), one.task.starts, one.task.names) == (2, (0,), ("b",))
    assert np.array_equal(one.grasps(one.arms[0]), grasps[[1, 1]])
    assert np.array_equal(cell.part(0, 5).flange_targets(arm), cell.flange_targets(arm))


def test_two_arms_of_one_name_are_refused() -> None:
    with pytest.raises(InvalidInput, match="'left' too") as refused:
        Cell(Task(POSES), (make_arm(name="left"), make_arm(name="right"), make_arm(name="left")))
    assert refused.value.pointer == "/arms/2/name"
