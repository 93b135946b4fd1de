"""Candidates that are worth a local solve: improved on the whole task, usable ones among them where there are any."""

from __future__ import annotations

import numpy as np

from bench.random_arms.draw import draw
from optimizer.box import search_box
from optimizer.reduced import evaluate_signed, reduced_problem
from optimizer.screening import screen
from optimizer.single_arm.worth import MOVED, USABLE_TOO, WORTH, worth_solving


def screened(kind, seed):
    cell = draw(kind, seed)
    problem = reduced_problem(cell, cell.arms[0])
    return problem, screen(problem, search_box(cell, cell.arms[0]), 0)


def test_a_usable_candidate_is_solved_from_where_the_cheapest_are_not_usable():
    """Six places with a joint step that is too long are cheaper than the one with the best base."""
    problem, found = screened("random", 199)
    assert all(candidate.violation > 0.0 for candidate in found.candidates[:MOVED])
    worth = worth_solving(found, problem)
    assert worth[0].violation == 0.0
    assert worth[0].objective < 56.24
    assert MOVED < len(worth) <= MOVED + USABLE_TOO


def test_candidates_are_scored_on_the_whole_task_and_none_is_much_dearer_than_the_best():
    problem, found = screened("dwell", 200)
    assert len(found.problem.positions) < len(problem.positions)
    worth = worth_solving(found, problem)
    usable = [candidate for candidate in worth if candidate.violation == 0.0]
    values = [candidate.objective for candidate in usable]
    assert values == sorted(values)
    assert values[-1] <= WORTH * values[0]
    places, signs = np.array([c.position for c in worth]), np.array([c.signs for c in worth])
    paths = evaluate_signed(problem, places, signs)
    np.testing.assert_allclose(paths.objective[0], [c.objective for c in worth], rtol=1e-9)
    np.testing.assert_allclose(paths.violation[0], [c.violation for c in worth], atol=1e-12)
