"""The trial of redundant arms: draws are possible, its own feasibility test refuses what is broken."""

from __future__ import annotations

import time

import numpy as np
import pytest

from bench.draws.redundant_draw import arms_without_reduction, drawn_cell
from bench.trials.redundant_arms import line_of, objective_if_usable, with_few_poses
from bench.trials.trial import draw_of
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.search import search_arm


def test_every_robot_without_reduction_is_drawn() -> None:
    limited, endless = arms_without_reduction(False), arms_without_reduction(True)
    assert {"iiwa14", "franka_panda", "xarm7", "rizon4", "kassow_kr810"} <= set(limited)
    assert {"gen3", "jaco2"} <= set(endless)
    assert not set(limited) & set(endless)


def test_an_answer_is_usable_and_a_broken_one_is_not() -> None:
    cell = drawn_cell(draw_of("redundant arms", 13), "iiwa14")
    arm = cell.arms[0]
    search = search_arm(cell, arm, Settings(), time.perf_counter() + 600.0)
    best = search.best
    assert best is not None
    assert objective_if_usable(cell, arm, best.position, best.yaw, best.joints) == pytest.approx(search.objective)
    for offset in (1e-4 * np.eye(arm.dof)[3], np.full(arm.dof, 2.0 * np.pi)):
        assert objective_if_usable(cell, arm, best.position, best.yaw, best.joints + offset) == np.inf
    assert objective_if_usable(cell, arm, best.position + np.array([5.0, 0.0, 0.0]), best.yaw, best.joints) == np.inf


def test_dwells_and_slopes_are_drawn() -> None:
    dwell = drawn_cell(draw_of("redundant arms dwell", 0), "iiwa14", "dwell")
    assert len(dwell.task) > 200
    few, rows = with_few_poses(dwell)
    assert len(few.task) < 40
    assert np.max(np.abs(few.task.poses[rows] - dwell.task.poses)) < 1e-2
    assert np.sum(few.task.weights) == len(dwell.task)
    tilted = drawn_cell(draw_of("redundant arms tilted", 0), "iiwa14", "tilted")
    assert not tilted.arms[0].upright


def test_a_miss_is_told() -> None:
    record = {"seed": 1, "robot": "r", "poses": 3, "objective": 2.0, "known": 1.0, "cpu": 0.1, "judged": 1.0}
    assert line_of(record).endswith("MISS")
    assert "MISS" not in line_of(record | {"objective": 1.0005})
