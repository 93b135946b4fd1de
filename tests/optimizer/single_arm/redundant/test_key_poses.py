"""Key poses: both ends, a dwell as well as the way, and nothing that depends on the direction."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.task import Task, line
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.single_arm.redundant.key_poses import key_poses, partly_moved, reduced_to, shares
from duocell.optimizer.single_arm.redundant.unreduced_problem import UnreducedProblem, unreduced_problem
from tests.support.given.tasks import possible


def problem_of(task: Task) -> UnreducedProblem:
    drawn = possible("iiwa14", np.random.default_rng(1), poses=3)
    cell = drawn.cell
    arm = cell.arms[0]
    object.__setattr__(cell, "task", task)
    return unreduced_problem(cell, arm, search_box(cell, arm) * 0.0)


def straight(count: int) -> Task:
    start = transform(np.eye(3), np.array([0.3, 0.0, 0.4]))
    end = transform(rotation_z(0.8), np.array([0.6, 0.1, 0.5]))
    return line(start, end, count)


@pytest.mark.parametrize("count", [9, 10, 24])
@pytest.mark.parametrize("keys", [1, 4])
def test_the_same_poses_are_chosen_backwards(count: int, keys: int) -> None:
    task = straight(count)
    forth = key_poses(problem_of(task), keys)
    back = key_poses(problem_of(Task(task.poses[::-1])), keys)
    assert sorted(count - 1 - back) == sorted(forth)


def test_a_dwell_is_looked_at_as_well_as_the_way() -> None:
    task = straight(20)
    dwelling = Task(np.concatenate([task.poses[:6], np.repeat(task.poses[5:6], 200, axis=0), task.poses[6:]]))
    problem = problem_of(dwelling)
    keys = key_poses(problem, 8)
    assert keys[0] == 0
    assert keys[-1] == len(dwelling) - 1
    inside = np.sum((keys > 5) & (keys < 206))
    assert 2 <= inside <= 5
    weights = reduced_to(problem, keys).weights
    assert np.sum(weights) == pytest.approx(len(keys))
    assert np.sum(weights[(keys >= 5) & (keys <= 206)]) > 0.9 * len(keys)


def test_joints_go_linearly_from_key_to_key_within_each_segment() -> None:
    task = task_sequence([TaskSegment("a", straight(9)), TaskSegment("b", straight(5))])
    problem = problem_of(task)
    keys = np.array([0, 4, 8, 9, 13])
    matrix = shares(problem, keys)
    assert np.allclose(matrix.sum(axis=1), 1.0)
    assert np.allclose(matrix[2], [0.5, 0.5, 0.0, 0.0, 0.0])
    assert np.allclose(matrix[11], [0.0, 0.0, 0.0, 0.5, 0.5])


def test_halfway_is_halfway() -> None:
    problem = problem_of(straight(5))
    keys, anchors = np.array([0, 4]), np.array([2])
    half = partly_moved(problem.only(anchors, np.ones(1)), problem.only(keys, np.ones(2)), 0.5)
    assert np.allclose(half.positions, problem.positions[[1, 3]])
    assert np.allclose(half.rotations, problem.rotations[[1, 3]])
