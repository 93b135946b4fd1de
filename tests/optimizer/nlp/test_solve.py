"""Local solves: every way IPOPT can end is known, and points are what they are said to be."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from duocell.models.base.pose import rotation_angle, rotation_z, transform
from duocell.models.cell.task import Task
from duocell.models.kinematics.kinematics import flange_poses
from duocell.optimizer.nlp import solve
from duocell.optimizer.nlp.program import ArmSolution, Cuts, build_program
from duocell.optimizer.nlp.solve import STATUS, Solve, SolveStatus, solve_program
from tests.support.given.tasks import Possible, possible
from tests.support.given.witness import witness_of
from tests.support.present import present

LIBRARY = Path(ca.__file__).parent / "libcasadi_nlpsol_ipopt.so"
HEADER = Path(ca.__file__).parent / "include" / "coin-or" / "IpReturnCodes_inc.h"


def words_of_the_plugin() -> set[str]:
    """The words with which CasADi's interface to IPOPT answers, read from the library that is installed."""
    words = re.findall(rb"(?<=\x00)[A-Z][A-Za-z]*(?:_[A-Z][A-Za-z]*)+(?=\x00)", LIBRARY.read_bytes())
    return {word.decode() for word in words} - {"IPOPT_DEFAULT_LINEAR_SOLVER"}


def test_every_return_status_of_the_installed_ipopt_is_mapped() -> None:
    words = words_of_the_plugin()
    assert len(words) >= 20
    assert words | {"Unknown"} == set(STATUS)
    if HEADER.exists():  # not part of slim images
        codes = re.findall(r"^\s+([A-Z]\w+_\w+)\s*=\s*-?\d+", HEADER.read_text(), re.MULTILINE)
        assert words == set(codes) - {"RegularMode", "RestorationPhaseMode"}


def test_only_successes_and_limits_have_points_worth_a_look() -> None:
    assert {word for word, status in STATUS.items() if status is SolveStatus.OPTIMAL} == {"Solve_Succeeded"}
    for word, status in STATUS.items():
        assert status.has_point == (
            word.startswith(("Solve", "Feasible", "Maximum", "Search_Direction")) and word != "Solve_Failed"
        ), word
    assert STATUS["Infeasible_Problem_Detected"] is SolveStatus.INFEASIBLE
    assert STATUS["Maximum_WallTime_Exceeded"] is SolveStatus.LIMIT
    assert STATUS["Invalid_Number_Detected"] is SolveStatus.FAILED
    assert STATUS["User_Requested_Stop"] is SolveStatus.CANCELLED


def started(name: str, seed: int = 0, poses: int = 4, step: float = 0.12) -> tuple[Possible, ArmSolution]:
    """A possible task and its witness, a good start."""
    task = possible(name, np.random.default_rng(seed), poses=poses, step=step, half=(0.3, 0.3, 0.0, np.pi))
    return task, witness_of(task)


def solved(task: Possible, point: ArmSolution, time_limit: float = 60.0, cuts: list[Cuts] | None = None) -> Solve:
    program = build_program(task.cell, [task.arm], [point], keep_shoulder=point.signs is not None, cuts=cuts)
    return solve_program(program, [point], time_limit)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "iiwa14"])
def test_a_solve_lowers_the_cost_and_stays_within_all_bounds(name: str) -> None:
    task, start = started(name)
    result = solved(task, start)
    point, arm = result.points[0], task.arm
    before = float(np.sum(arm.weights * (start.joints - arm.reference) ** 2))
    assert result.status is SolveStatus.OPTIMAL
    assert result.engine_status == "Solve_Succeeded"
    assert result.objective == pytest.approx(np.sum(arm.weights * (point.joints - arm.reference) ** 2), rel=1e-8)
    assert result.objective < before
    assert result.violation < 1e-8
    assert np.all(point.joints >= arm.lower)
    assert np.all(point.joints <= arm.upper)
    assert point.signs == start.signs
    assert result.iterations > 0


def test_a_solve_says_how_long_it_took() -> None:
    task, start = started("ur10e", poses=20)
    assert solved(task, start).wall_time > 0.0


def test_time_that_has_run_out_gives_the_last_iterate() -> None:
    task, start = started("ur10e", poses=1200, step=0.0007)
    result = solved(task, start, 1e-3)
    assert result.engine_status == "Maximum_WallTime_Exceeded"
    assert result.status is SolveStatus.LIMIT
    assert result.points[0].joints.shape == (1200, 6)


def test_iterations_that_have_run_out_give_the_last_iterate(monkeypatch: pytest.MonkeyPatch) -> None:
    solve._solver.cache_clear()
    monkeypatch.setitem(solve.IPOPT_OPTIONS, "max_iter", 1)
    task, start = started("puma560")
    result = solved(task, start, 59.0)
    solve._solver.cache_clear()
    assert result.engine_status == "Maximum_Iterations_Exceeded"
    assert result.status is SolveStatus.LIMIT
    assert result.iterations == 1


def test_poses_that_are_too_far_apart_are_infeasible_not_an_error() -> None:
    task, start = started("puma560")
    poses = task.cell.task.poses.copy()
    poses[-1, :3, 3] += [0.0, 0.0, 3.0]
    result = solved(replace(task, cell=replace(task.cell, task=Task(poses))), start)
    assert not result.status.has_point or result.violation > 0.1
    assert result.status in (SolveStatus.INFEASIBLE, SolveStatus.LIMIT, SolveStatus.FAILED)


def test_limits_that_rule_the_posture_out_are_infeasible_not_an_error() -> None:
    task, start = started("ur10e")
    shoulder, elbow, wrist = present(start.signs)
    low, high = task.arm.lower.copy(), task.arm.upper.copy()
    low[2], high[2] = (0.1, 0.5) if task.joints[0, 2] > 0 else (-0.5, -0.1)
    arm = replace(task.arm, lower=low, upper=high)
    other = replace(start, signs=(shoulder, -elbow, wrist), joints=start.joints * [1, 1, -1, 1, 1, 1])
    cell = replace(task.cell, arms=(arm,))
    result = solve_program(build_program(cell, [arm], [other], keep_shoulder=True), [other])
    assert result.status is SolveStatus.INFEASIBLE
    assert not result.status.has_point


def test_a_start_that_is_no_number_fails_without_an_exception() -> None:
    task, start = started("puma560")
    result = solved(task, replace(start, yaw=float("nan")))
    assert result.status is SolveStatus.FAILED
    assert not result.status.has_point


def test_cuts_hold_at_the_solution() -> None:
    """A linear row on the joints of one pose is respected and costs something."""
    task, start = started("puma560", 4)
    free = solved(task, start)
    assert free.status is SolveStatus.OPTIMAL
    bend = free.points[0].joints[1, 1]
    gradients, bounds = np.zeros((4, 6)), np.full(4, -np.inf)
    towards = 0.02 if start.joints[1, 1] > bend else -0.02
    gradients[1, 1], bounds[1] = np.sign(towards), np.sign(towards) * (bend + towards)
    held = solved(task, start, cuts=[Cuts(gradients, bounds)])
    assert held.status is SolveStatus.OPTIMAL
    assert (held.points[0].joints[1, 1] - bend) / towards >= 1.0 - 1e-6
    assert held.objective > free.objective


def test_two_arms_in_one_program_are_two_arms_alone() -> None:
    first, a = started("puma560", 2)
    second = replace(first.arm, name="b", reference=first.arm.reference + 0.1)
    alone = solved(first, a)
    other = solved(replace(first, cell=replace(first.cell, arms=(second,))), a)
    optima = [alone.points[0], other.points[0]]  # both start in the basins that they end in alone
    both = solve_program(build_program(first.cell, [first.arm, second], optima, keep_shoulder=True), optima)
    assert both.status is SolveStatus.OPTIMAL
    assert both.objective == pytest.approx(alone.objective + other.objective, rel=1e-6)
    assert both.points[0].position == pytest.approx(alone.points[0].position, abs=1e-5)
    assert both.points[1].position == pytest.approx(other.points[0].position, abs=1e-5)


def test_half_a_turn_of_orientation_is_never_an_answer() -> None:
    """From starts turned by about 180° about random axes the solve ends at the true orientation, or says it failed."""
    rng = np.random.default_rng(0)
    task, start = started("puma560", 3)
    wanted = task.cell.flange_targets(task.arm)
    for _ in range(8):
        joints = start.joints + rng.choice([-np.pi, np.pi, 0.0], 6)[None] * [0, 0, 0, 1, 0, 1] + rng.normal(0, 0.05, 6)
        joints = np.clip(joints, task.arm.lower, task.arm.upper)
        result = solved(task, replace(start, joints=joints, signs=None))
        if result.status in (SolveStatus.OPTIMAL, SolveStatus.ACCEPTABLE):
            point = result.points[0]
            base = transform(rotation_z(point.yaw), point.position)
            reached = base @ flange_poses(task.arm.robot, point.joints)
            turned = rotation_angle(np.swapaxes(wanted[:, :3, :3], 1, 2) @ reached[:, :3, :3])
            assert turned.max() < 1e-6


def test_a_second_solve_of_the_same_shape_builds_no_second_solver() -> None:
    """Deadlines differ from solve to solve by fractions of a second; building costs more than solving."""
    task, start = started("puma560", 5)
    solve._solver.cache_clear()
    for time_limit in (59.871, 59.643, 59.402):
        assert solved(task, start, time_limit).status is SolveStatus.OPTIMAL
    assert solve._solver.cache_info().misses == 1
