"""Candidates brought to their optimum without the local solver end where it ends too, and unusable ones are dropped."""

from __future__ import annotations

import time

import numpy as np
import pytest

from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.parameters.local import LOCAL
from duocell.optimizer.parameters.search import SEARCH
from duocell.optimizer.reduction.base_sample import BoxFrame
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.reduced import evaluate_signed, reduced_problem
from duocell.optimizer.reduction.screening import Candidate
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.single_arm.refinement import brought_to_optimum, path_from
from duocell.optimizer.verification.verify import check
from tests.support.given.tasks import possible
from tests.support.present import present


@pytest.mark.parametrize("name", ["ur10e", "kr6_r900"])
def test_a_candidate_ends_where_the_local_solver_ends(name: str) -> None:
    task = possible(name, np.random.default_rng(2), half=(0.2, 0.2, 0.0, np.pi))
    problem, box = present(reduced_problem(task.cell, task.arm)), search_box(task.cell, task.arm)
    paths = evaluate_signed(problem, np.tile(task.position, (8, 1)), np.array(ALL_SIGNS))
    k = int(np.argmin(np.where(paths.violation[0] == 0.0, paths.objective[0], np.inf)))
    start = path_from(problem, task.position, ALL_SIGNS[k])
    assert objective_of(task.cell, task.arm, start.joints) == pytest.approx(paths.objective[0, k], rel=1e-9)
    solved = solve_locally(task.cell, task.arm, start, time.perf_counter() + 60.0)
    near = np.clip(solved.points[0].position + np.array([0.03, -0.02, 0.0]), box[:, 0], box[:, 1])
    paths = evaluate_signed(problem, near[None], np.array([ALL_SIGNS[k]]))
    assert paths.violation[0, 0] == 0.0
    candidate = Candidate(near, ALL_SIGNS[k], float(paths.objective[0, 0]), 0.0)
    radius = np.array([0.03, 0.03, 0.0])
    found = brought_to_optimum(
        task.cell, problem, BoxFrame.of(problem, box), radius, [candidate] * (LOCAL.finished + 2), SEARCH
    )
    assert len(found) == LOCAL.finished
    value, point = found[0]
    assert check(task.cell, task.arm, point).usable
    assert solved.objective * (1.0 - 1e-6) <= value <= min(solved.objective * (1.0 + 1e-4), candidate.objective)


def test_what_is_not_usable_in_the_end_is_dropped() -> None:
    task = possible("puma560", np.random.default_rng(2), half=(0.2, 0.2, 0.0, np.pi))
    problem, box = present(reduced_problem(task.cell, task.arm)), search_box(task.cell, task.arm)
    away = Candidate(task.position + np.array([5.0, 0.0, 0.0]), (1, 1, 1), 1.0, 0.0)
    frame = BoxFrame.of(problem, np.stack([away.position, away.position], axis=1))
    assert brought_to_optimum(task.cell, problem, frame, np.zeros(3), [away], SEARCH) == []
    assert brought_to_optimum(task.cell, problem, BoxFrame.of(problem, box), np.zeros(3), [], SEARCH) == []
