"""The benchmark measures what it says: its problems, its clock, its tasks and its bookkeeping."""

from collections.abc import Callable
from math import inf
from time import process_time

import numpy as np
import pytest

from bench.comparison import tables
from bench.comparison.contenders import OURS
from bench.comparison.problem import Clock, Enough, FullProblem, Problem, ReducedProblem
from bench.comparison.record import Part, Record
from bench.comparison.run import TaskResult
from bench.comparison.tasks import all_tasks, free_height, quick_tasks, thesis_line
from bench.draws.random_tasks import random_cell
from bench.peers import PEERS, Peer
from bench.timings.server import request_of
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate
from duocell.service.validation.strict_json import parse
from tests.support.present import present

OPTIMUM = 68.4789064
BEST = np.array([0.1561, 0.9551, -0.8767])
"""Of the first arm of the line."""


def _run(search: Callable[[Problem, int], object], problem: Problem) -> Clock:
    with pytest.raises(Enough):
        search(problem, 3)
    return problem.clock


def test_both_forms_of_the_problem_agree_with_each_other() -> None:
    cell = thesis_line(10)
    full = FullProblem(cell, cell.arms[:1], Clock(inf, -inf))
    reduced = ReducedProblem(cell, cell.arms[0], Clock(inf, -inf))
    assert full.costs(BEST[None])[0] == pytest.approx(OPTIMUM, rel=1e-3)
    assert reduced.costs(BEST[None, :2])[0] == pytest.approx(OPTIMUM, rel=1e-3)
    rng = np.random.default_rng(0)
    for candidate in rng.uniform(full.low, full.high, (20, 3)):
        assert reduced.costs(candidate[None, :2])[0] <= full.costs(candidate[None])[0] + 1e-9  # its yaw is the best


def test_the_full_problem_holds_all_arms_and_their_free_components() -> None:
    cell = free_height(thesis_line(10))
    assert len(FullProblem(cell, cell.arms, Clock(inf, -inf)).low) == 8
    assert len(ReducedProblem(cell, cell.arms[0], Clock(inf, -inf)).low) == 3


def test_infeasible_candidates_cost_something_finite_and_are_never_a_result() -> None:
    cell = thesis_line(10)
    problem = ReducedProblem(cell, cell.arms[0], Clock(inf, -inf))
    costs = problem.costs(np.array([problem.low, problem.high]))
    assert np.isfinite(costs).all()
    assert (costs > 1000.0).all()
    assert problem.clock.best == inf
    assert problem.clock.evaluations == 2


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
@pytest.mark.parametrize("form", ["full", "reduced"])
def test_every_peer_searches_both_forms_until_its_time_is_up(peer: Peer, form: str) -> None:
    cell = thesis_line(10)
    clock = Clock(0.4, -inf)
    arms = cell.arms if peer.joint else cell.arms[:1]
    problem = FullProblem(cell, arms, clock) if form == "full" else ReducedProblem(cell, cell.arms[0], clock)
    began = process_time()
    _run(peer.search, problem)
    assert 0.35 <= process_time() - began < 3.0
    assert clock.evaluations > 10
    values = [value for _, value in clock.trace]
    assert values == sorted(values, reverse=True)
    assert all(value >= OPTIMUM * (1.0 - 1e-6) for value in values)


def test_a_search_ends_at_its_target() -> None:
    cell = thesis_line(10)
    clock = _run(PEERS[0].search, ReducedProblem(cell, cell.arms[0], Clock(60.0, 1.01 * OPTIMUM)))
    assert clock.best <= 1.01 * OPTIMUM


def test_random_tasks_are_feasible_different_and_always_the_same() -> None:
    cells = [random_cell(seed) for seed in range(4)]
    assert len({len(cell.task) for cell in cells}) > 1
    assert (random_cell(2).task.poses == cells[2].task.poses).all()
    for cell in cells:
        assert 5 <= len(cell.task) <= 25
        for arm in cell.arms:
            spots = np.random.default_rng(0).uniform(arm.base.bounds[:3, 0], arm.base.bounds[:3, 1], (4000, 3))
            assert (evaluate(present(reduced_problem(cell, arm)), spots).violation == 0.0).any()


def test_the_task_set_is_the_one_described() -> None:
    tasks = all_tasks()
    groups = [task.group for task in tasks]
    assert groups.count("random") == 20
    assert {"thesis-shaped", "UR10e pair", "100 poses", "1,000 poses", "z free"} <= set(groups)
    assert {len(task.cell.task) for task in tasks} >= {100, 1000}
    assert {task.name for task in quick_tasks()} < {task.name for task in tasks}


def test_requests_over_http_are_the_cells_of_the_benchmark() -> None:
    cell = thesis_line(10)
    again = cell_of(validate(LayoutRequest, parse(request_of(cell))), None)
    for mine, theirs in zip(cell.arms, again.arms, strict=True):
        assert cell.flange_targets(mine) == pytest.approx(again.flange_targets(theirs), abs=1e-12)
        assert mine.base.bounds == pytest.approx(theirs.base.bounds)
        assert mine.weights == pytest.approx(theirs.weights)


def _result() -> TaskResult:
    own = Record("t", OURS, "own", [Part([0, 1], [(0.1, 30.0)], 100, 0.1)])
    slow = Record("t", "slow", "full", [Part([0, 1], [(1.0, 40.0), (2.0, 30.02)], 500, 3.0)])
    never = Record("t", "never", "full", [Part([0], [(0.5, 10.0)], 50, 1.0), Part([1], [(0.2, 20.3)], 50, 1.0)])
    split = Record("t", "split", "reduced", [Part([0], [(0.5, 10.0)], 50, 0.7), Part([1], [(0.2, 20.0)], 50, 0.3)])
    return TaskResult("t", "g", 10, 6, [10.0, 20.0], 29.9, 0.1 / 30.0, [own, slow, never, split])


def test_times_to_quality() -> None:
    _, slow, never, split = _result().records
    assert slow.solved_after([10.0, 20.0]) == 2.0
    assert never.solved_after([10.0, 20.0]) == inf
    assert split.solved_after([10.0, 20.0]) == 0.7
    assert split.combined_trace() == [pytest.approx((0.9, 30.0))]
    assert Record("t", "m", "full", [Part([0], [], 5, 1.0)]).combined_trace() == []


def test_tables_say_who_solved_what() -> None:
    full = tables.comparison([_result()], "full")
    assert "| slow | 1 of 1 | 2 s | 500 | 20 × |" in full
    assert "| never | 0 of 1 | > 2 s | 100 | > 20 × |" in full
    assert "split" not in full
    assert "| split | 1 of 1 | 0.7 s | 100 | 7 × |" in tables.comparison([_result()], "reduced")
    assert "| t | 10 | 6 | 30 | 0.33% | 0.100 s | 2.000 s, slow | 0.700 s, split |" in tables.tasks([_result()])


def test_who_was_faster_is_told() -> None:
    assert tables.faster([_result()]) == ""
    result = _result()
    result.records[-1] = Record("t", "quick", "reduced", [Part([0, 1], [(0.04, 30.0)], 50, 0.05)])
    assert tables.faster([result, _result()]) == "t (quick, 2.5 × as fast)"
