"""Poses of a part that is held: one stands for many, none is lost, and what moves slowly is not held."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.single_arm.redundant.held_poses import with_held_poses
from tests.support.given.fields import WitnessFields
from tests.support.given.tasks import possible


def resting(at: int, count: int, drift: float = 0.0, **given: Unpack[WitnessFields]) -> Cell:
    """A task of 8 poses that rests at one of them; the part drifts by so many metres meanwhile."""
    cell = possible("iiwa14", np.random.default_rng(3), poses=8, **given).cell
    poses = cell.task.poses[np.sort(np.append(np.arange(8), np.full(count - 1, at)))].copy()
    poses[at : at + count, 0, 3] += np.linspace(0.0, drift, count)
    return replace(cell, task=Task(poses, weights=np.linspace(1.0, 2.0, len(poses))))


def test_one_pose_stands_for_those_of_a_rest() -> None:
    cell = resting(3, 100)
    held = with_held_poses(cell, 6)
    assert held is not None
    assert len(held.cell.task) == 8
    assert np.array_equal(held.cell.task.poses, cell.task.poses[[0, 1, 2, 3, 103, 104, 105, 106]])
    assert np.allclose(held.cell.task.poses[held.rows], cell.task.poses)
    assert np.sum(held.cell.task.weights) == pytest.approx(np.sum(cell.task.weights))
    assert held.cell.task.weights[3] == pytest.approx(np.sum(cell.task.weights[3:103]))


@pytest.mark.parametrize(("step", "turning"), [(np.pi / 2, 3), (0.4, 8), (0.05, 12)])
def test_an_arm_with_spare_freedom_has_time_to_turn(step: float, turning: int) -> None:
    held = with_held_poses(resting(3, 100, max_joint_step=step), 7)
    assert held is not None
    assert len(held.cell.task) == 8 + 2 * turning
    assert np.argmax(held.cell.task.weights) == 3 + turning


def test_a_part_that_moves_slowly_is_not_held() -> None:
    assert with_held_poses(resting(3, 100, drift=0.045), 7) is None
    assert with_held_poses(resting(3, 100, drift=0.005), 7) is not None
    assert with_held_poses(possible("iiwa14", np.random.default_rng(4)).cell, 7) is None


def test_nothing_depends_on_the_direction() -> None:
    cell = resting(5, 60, drift=0.003)
    back = replace(cell, task=Task(cell.task.poses[::-1], weights=cell.task.weights[::-1]))
    one, other = with_held_poses(cell, 7), with_held_poses(back, 7)
    assert one is not None
    assert other is not None
    assert np.allclose(one.cell.task.weights, other.cell.task.weights[::-1])
    assert np.allclose(one.cell.task.poses, other.cell.task.poses[::-1], atol=1e-4)


def test_segments_stay_apart_although_one_begins_where_the_other_ends() -> None:
    cell = resting(3, 100)
    segments = replace(cell, task=Task(cell.task.poses, (0, 50), weights=cell.task.weights))
    held = with_held_poses(segments, 6)
    assert held is not None
    assert held.cell.task.starts == (0, 4)
    assert len(held.cell.task) == 9


def test_a_point_is_carried_over_to_all_poses() -> None:
    cell = resting(3, 100)
    held = with_held_poses(cell, 7)
    assert held is not None
    joints = np.arange(7.0 * len(held.cell.task)).reshape(-1, 7)
    whole = held.on_whole(ArmSolution(np.zeros(3), 0.0, joints))
    assert whole.joints.shape == (len(cell.task), 7)
    assert np.array_equal(np.unique(whole.joints[:, 0]), joints[:, 0])
