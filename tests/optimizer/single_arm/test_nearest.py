"""What was seen that comes nearest to being usable: chosen by what the whole task breaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.kinematics.kinematics import flange_poses
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.layers import LayeredPath
from duocell.optimizer.reduction.reduced import evaluate_signed, reduced_problem
from duocell.optimizer.reduction.screening import Candidate, screen
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.nearest import nearest_candidate, nearest_path
from tests.support.given.tasks import possible
from tests.support.present import present


def test_the_candidate_that_breaks_least_of_the_whole_task_is_chosen_whatever_it_costs() -> None:
    task = possible("ur10e", np.random.default_rng(3))
    problem = present(reduced_problem(task.cell, task.arm))
    signs = screen(problem, search_box(task.cell, task.arm), 0).candidates[0].signs
    places = task.position + np.array([[2.0, 0.0, 0.0], [1.6, 0.0, 0.0], [1.3, 0.0, 0.0]])
    broken = evaluate_signed(problem, places, np.array([signs] * 3)).violation[0]
    as_sampled = [Candidate(place, signs, 100.0 * k, 1.0) for k, place in enumerate(places)]
    found = nearest_candidate(problem, [*as_sampled, Candidate(task.position, signs, 0.0, np.inf)])
    assert found is not None
    np.testing.assert_array_equal(found.position, places[int(np.argmin(broken))])
    assert len(found.joints) == len(task.cell.task)
    assert nearest_candidate(problem, []) is None
    assert nearest_candidate(problem, [Candidate(task.position, signs, 0.0, np.inf)]) is None


def test_the_whole_path_that_breaks_least_is_chosen() -> None:
    joints = np.zeros((2, 6))
    paths = [LayeredPath(np.full(3, float(k)), 0.0, joints, cost, off) for k, cost, off in ((0, 1, 0.2), (1, 9, 0.1))]
    incomplete = LayeredPath(np.zeros(3), 0.0, np.empty((0, 6)), np.inf, np.inf, (0,))
    found = nearest_path([incomplete, *paths])
    assert found is not None
    assert found.position[0] == 1.0
    assert nearest_path([incomplete]) is None


def test_an_answer_without_a_layout_shows_what_came_nearest() -> None:
    """Joints may not move as far as the task asks for: everything holds but a limit or a step."""
    task = possible("ur10e", np.random.default_rng(3), half=(0.2, 0.2, 0.0, np.pi))
    asked = replace(task.cell, max_joint_step=0.2 * float(np.max(np.abs(np.diff(task.joints, axis=0)))))
    layout = optimize(asked, Settings(certificate=None))
    assert not layout.usable
    assert layout.objective is None
    assert all(segment.objective is None for segment in layout.segments)
    (nearest,) = layout.placements
    base = task.arm.base_in_world(nearest.position, nearest.yaw)
    reached = base @ flange_poses(task.arm.robot, nearest.joints) @ task.arm.tool
    np.testing.assert_allclose(reached, asked.task.poses @ asked.grasps(task.arm), atol=1e-6)
    step = float(np.max(np.abs(np.diff(nearest.joints, axis=0))))
    assert step > asked.max_joint_step or nearest.minimum_margin < 0.0
    assert layout.verification is not None
    assert layout.verification.max_joint_step == pytest.approx(step, abs=1e-12)
