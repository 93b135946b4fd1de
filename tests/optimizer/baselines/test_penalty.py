"""The penalty methods on the two acceptance cases."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.posture import ALL_SIGNS, name_signs
from duocell.optimizer.baselines.gradient import PostureFunction, paths_at
from duocell.optimizer.baselines.penalty import METHODS, minimise_from, nearest_posture, run_baseline
from duocell.optimizer.baselines.starts import LEFT, RIGHT, source_start
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem
from duocell.optimizer.results.layout import Baseline
from duocell.optimizer.settings import Settings
from tests.support.given.thesis import BEST_KNOWN, CELLS, LOWER_BOUNDS, MAIN_GRASP
from tests.support.present import present


@cache
def _baseline(name: str, method: str) -> Baseline:
    return run_baseline(method, CELLS[name], Settings())


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CELLS)
def test_results_respect_the_proved_bounds_and_the_reduced_evaluator(name: str, method: str) -> None:
    cell, baseline = CELLS[name], _baseline(name, method)
    assert baseline.feasible
    assert [arm.arm for arm in baseline.arms] == ["main", "follower"]
    assert baseline.objective == pytest.approx(sum(present(arm.objective) for arm in baseline.arms))
    for arm, result, bound in zip(cell.arms, baseline.arms, LOWER_BOUNDS[name], strict=True):
        problem = present(reduced_problem(cell, arm))
        index = next(k for k, signs in enumerate(ALL_SIGNS) if name_signs(signs) == result.posture)
        there = paths_at(problem, np.array([*result.position, result.yaw]))
        assert result.feasible
        assert there.violation[index, 0] <= 1e-8
        assert there.objective[index, 0] == pytest.approx(result.objective, rel=1e-9)
        assert present(result.objective) >= bound
        free = evaluate(problem, result.position[None])
        # the best yaw is no worse than the found one
        assert free.objective[index, 0] <= present(result.objective) + 1e-9
        assert arm.base.x.low <= result.position[0] <= arm.base.x.high
        assert arm.base.y.low <= result.position[1] <= arm.base.y.high


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CELLS)
def test_the_better_assignment_reaches_the_optimum_of_the_acceptance_cases(name: str, method: str) -> None:
    assert _baseline(name, method).objective == pytest.approx(BEST_KNOWN[name], rel=1e-4)


@pytest.mark.parametrize("method", ["interior-penalty", "interior-penalty-log"])
def test_interior_cycles_shrink_their_parameter_and_stay_inside(method: str) -> None:
    for name in CELLS:
        for arm in _baseline(name, method).arms:
            cycles = [cycle for cycle in arm.trace if cycle.phase == "interior"]
            assert len(cycles) > 5
            assert all(cycle.worst < 0.0 for cycle in cycles)
            for before, after in pairwise(cycles):
                assert after.parameter == pytest.approx(0.3 * before.parameter)
                # E(x_r) falls with r', the classical property of barrier functions
                assert present(after.objective) <= present(before.objective) * (1.0 + 1e-6)


def test_inverse_barrier_adds_to_e_and_less_every_cycle() -> None:
    for arm in _baseline("line", "interior-penalty").arms:
        gaps = [cycle.penalised - present(cycle.objective) for cycle in arm.trace]
        assert all(gap > 0.0 for gap in gaps)
        assert all(after < before for before, after in pairwise(gaps))


def test_exterior_cycles_approach_from_outside() -> None:
    """Its E rises and its violation falls as r grows, on an arm whose optimum lies on a limit."""
    cell = CELLS["line"]
    arm = cell.arms[0]
    best = _baseline("line", "exterior-penalty").arms[0]
    path = present(
        PostureFunction(present(reduced_problem(cell, arm)), (1, -1, -1)).begin(np.array([*best.position, best.yaw]))
    )
    joint, limit = 3, float(path.joints[:, 3].max()) - 0.2
    upper = arm.upper.copy()
    upper[joint] = limit
    tight = replace(arm, upper=upper)
    problem = present(reduced_problem(Cell(cell.task, (tight,)), tight))
    run = minimise_from(problem, source_start(cell, arm, LEFT), (1, -1, -1), "exterior-penalty")
    assert run.feasible
    assert len(run.trace) >= 3
    assert run.trace[0].worst > 1e-3
    for before, after in pairwise(run.trace):
        assert after.worst <= before.worst + 1e-9
        assert present(after.objective) >= present(before.objective) - 1e-6
        assert after.parameter == pytest.approx(10.0 * before.parameter)
    assert present(run.joints)[:, joint].max() == pytest.approx(limit, abs=2e-4)
    assert present(run.joints)[:, joint].max() <= limit


def test_an_infeasible_start_goes_through_the_exterior_phase() -> None:
    """The source's starts of the arc break joint limits on either side, in every posture."""
    cell = CELLS["arc"]
    for arm in cell.arms:
        problem = present(reduced_problem(cell, arm))
        for side in (LEFT, RIGHT):
            start = source_start(cell, arm, side)
            assert (paths_at(problem, start).violation > 0.04).all()
    for run in _baseline("arc", "interior-penalty").arms:
        assert "infeasible start" in run.note
        phases = [cycle.phase for cycle in run.trace]
        assert phases[0] == "exterior"
        assert phases[-1] == "interior"
        assert phases == sorted(phases)


def test_a_start_out_of_reach_goes_through_the_reach_phase() -> None:
    cell = CELLS["line"]
    problem = present(reduced_problem(cell, cell.arms[0]))
    start = np.array([-0.2, 1.6, 0.0, -0.7])
    assert nearest_posture(problem, start) is None
    run = minimise_from(problem, start, None, "interior-penalty")
    assert run.trace[0].phase == "reach"
    assert run.trace[0].objective is None
    assert "no inverse-kinematics solution at the start" in run.note
    assert run.feasible
    assert present(run.objective) >= LOWER_BOUNDS["line"][0]


def test_an_impossible_task_is_reported_and_not_solved() -> None:
    cell = CELLS["line"]
    poses = np.array(cell.task.poses)
    poses[-1, :3, 3] += [4.0, 0.0, 0.0]  # no base reaches both ends
    far = replace(cell, task=replace(cell.task, poses=poses))
    for method in METHODS:
        baseline = run_baseline(method, far, Settings())
        assert not baseline.feasible
        assert baseline.objective is None
        assert all("none" in arm.note and arm.objective is None for arm in baseline.arms)


def test_limits_that_no_base_can_keep_end_infeasible() -> None:
    cell = CELLS["line"]
    arm = cell.arms[0]
    upper = arm.upper.copy()
    upper[4] = arm.lower[4] + 0.05  # joint 5 may hardly move
    tight = replace(arm, upper=upper)
    problem = present(reduced_problem(Cell(cell.task, (tight,)), tight))
    run = minimise_from(problem, source_start(cell, arm, LEFT), None, "interior-penalty")
    assert not run.feasible
    assert "ended infeasible" in run.note


def test_arms_without_a_closed_form_get_a_note() -> None:
    cell = CELLS["line"]
    iiwa = robot("iiwa14")
    seven = Arm(
        "seven",
        iiwa,
        np.eye(4),
        MAIN_GRASP,
        cell.arms[0].base,
        iiwa.lower,
        iiwa.upper,
        iiwa.reference,
        range_weights(iiwa.lower, iiwa.upper),
    )
    baseline = run_baseline("interior-penalty", Cell(cell.task, (seven,)), Settings())
    assert (baseline.feasible, baseline.objective, baseline.arms) == (False, None, ())
    assert "seven" in baseline.note


def test_fixed_components_stay_and_a_bounded_yaw_is_kept() -> None:
    cell = CELLS["line"]
    arm = cell.arms[0]
    region = BaseRegion(arm.base.x, Interval(1.0, 1.0), Interval(-0.1, 0.1), Interval(5.0, 5.6))  # -73.5° to -39°
    narrow = replace(arm, base=region)
    problem = present(reduced_problem(Cell(cell.task, (narrow,)), narrow))
    start = source_start(cell, narrow, LEFT)
    assert start[1] == 1.0
    assert start[2] == 0.0
    run = minimise_from(problem, start, None, "interior-penalty-log")
    assert run.feasible
    assert run.placement[1] == 1.0
    assert -0.1 <= run.placement[2] <= 0.1
    assert run.placement[2] != 0.0
    assert 5.0 <= run.placement[3] <= 5.6


def test_a_base_that_may_not_move_is_only_judged() -> None:
    cell = CELLS["line"]
    best = _baseline("line", "interior-penalty").arms[0]
    region = BaseRegion(*(Interval(v, v) for v in (*best.position, best.yaw)))
    nailed = replace(cell.arms[0], base=region)
    problem = present(reduced_problem(Cell(cell.task, (nailed,)), nailed))
    run = minimise_from(problem, source_start(cell, nailed, RIGHT), (1, -1, -1), "interior-penalty")
    assert run.feasible
    assert run.objective == pytest.approx(best.objective)


def test_same_input_same_answer() -> None:
    again = run_baseline("exterior-penalty", CELLS["line"], Settings())
    for first, second in zip(_baseline("line", "exterior-penalty").arms, again.arms, strict=True):
        assert (first.position == second.position).all()
        assert (first.yaw, first.objective) == (second.yaw, second.objective)
        assert [c.evaluations for c in first.trace] == [c.evaluations for c in second.trace]


def test_no_time_means_no_cycles() -> None:
    baseline = run_baseline("interior-penalty", CELLS["arc"], Settings(time_limit=0.0))
    assert all(sum(cycle.iterations for cycle in arm.trace) == 0 for arm in baseline.arms)
