"""An optimum whose way cannot be gone is repaired by what it costs; places between the poses count for nothing."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from bench.draws.random_tasks import random_cell
from duocell.models.cell.task import Task
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.passable import passable, with_places
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.verify import check


@pytest.mark.parametrize("seed", [11, 13, 21])
def test_the_answer_can_be_followed_where_the_best_at_the_poses_cannot(seed: int) -> None:
    cell = random_cell(seed)
    stuck = 0
    for arm in cell.arms:
        found = search_arm(cell, arm, Settings(), time.perf_counter() + 60.0)
        value, point = found.optima[0]
        checked = check_arm_path(cell, arm, point)
        assert found.best is not None
        assert check_arm_path(cell, arm, found.best).free
        assert check(cell, arm, found.best).usable
        assert found.objective == pytest.approx(objective_of(cell, arm, found.best.joints), rel=1e-9)
        if checked.free:
            assert found.objective == value
            continue
        stuck += 1
        assert value < found.objective < 1.05 * value
        repaired = passable(cell, arm, point, checked, time.perf_counter() + 60.0)
        assert repaired is not None
        assert found.objective <= repaired[0]
    assert stuck == 1


def test_places_are_poses_of_no_weight_in_their_order_and_segment() -> None:
    cell = random_cell(0)
    poses, weights = cell.task.poses[:5], np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    task = Task(poses, starts=(0, 2), weights=weights)
    finer, rows = with_places(replace(cell, task=task), [(0, 0.5), (2, 0.25), (2, 0.75)])
    assert np.array_equal(finer.task.poses[rows], task.poses)
    assert np.array_equal(finer.task.weights[rows], task.weights)
    added = np.setdiff1d(np.arange(len(finer.task)), rows)
    assert np.array_equal(added, [1, 4, 5])
    assert not np.any(finer.task.weights[added])
    assert np.array_equal(finer.task.segment_of[rows], task.segment_of)
    assert np.array_equal(finer.task.segment_of[added], task.segment_of[[0, 2, 2]])
    middle = 0.5 * (task.poses[0, :3, 3] + task.poses[1, :3, 3])
    np.testing.assert_allclose(finer.task.poses[1, :3, 3], middle, atol=1e-12)
