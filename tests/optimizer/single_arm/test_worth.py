"""Candidates that are worth a local solve: improved on the whole task, usable ones among them where there are any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.random_arms.draw import draw
from duocell.models.cell.task import Task
from duocell.optimizer.parameters.local import LOCAL
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.reduced import evaluate_signed, reduced_problem
from duocell.optimizer.reduction.screening import screen
from duocell.optimizer.single_arm.worth import worth_solving
from tests.support.given.tasks import possible
from tests.support.present import present


def test_a_usable_candidate_is_solved_from_where_the_cheapest_are_not_usable() -> None:
    """Six places with a joint step that is too long are cheaper than the one with the best base."""
    cell = draw("random", 199)
    problem = present(reduced_problem(cell, cell.arms[0]))
    found = screen(problem, search_box(cell, cell.arms[0]), 0)
    assert all(candidate.violation > 0.0 for candidate in found.candidates[: LOCAL.moved])
    worth = worth_solving(found, problem, LOCAL)
    assert worth[0].violation == 0.0
    assert worth[0].objective < 56.24
    assert LOCAL.moved < len(worth) <= LOCAL.moved + LOCAL.usable_too


def test_candidates_are_scored_on_the_whole_task_and_none_is_much_dearer_than_the_best() -> None:
    task = possible("ur10e", np.random.default_rng(4), half=(0.4, 0.4, 0.0, np.pi))
    stays = Task(np.repeat(task.cell.task.poses, [1] * (len(task.cell.task) - 1) + [150], axis=0))
    problem = present(reduced_problem(replace(task.cell, task=stays), task.arm))
    found = screen(problem, search_box(task.cell, task.arm), 0)
    assert len(found.problem.positions) < len(problem.positions)
    worth = worth_solving(found, problem, LOCAL)
    usable = [candidate for candidate in worth if candidate.violation == 0.0]
    values = [candidate.objective for candidate in usable]
    assert values == sorted(values)
    assert values[-1] <= LOCAL.worth * values[0]
    places, signs = np.array([c.position for c in worth]), np.array([c.signs for c in worth])
    paths = evaluate_signed(problem, places, signs)
    np.testing.assert_allclose(paths.objective[0], [c.objective for c in worth], rtol=1e-9)
    np.testing.assert_allclose(paths.violation[0], [c.violation for c in worth], atol=1e-12)
