"""Copies of one layout in a list of seeds: joints without end and a free yaw make as many as one likes."""

from __future__ import annotations

import numpy as np
import pytest

from bench.trials.waypoints import way_task
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.redundant.ranking import distinct, figures
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, unreduced_problem
from tests.support.oracles.answers import assert_ended

IIWA14, GEN3 = 46, 47
"""Way-point tasks of these robots; joints 1, 3, 5 and 7 of the Gen3 are without end."""
TURNS = np.linspace(-3.0, 3.0, 7)


def problem_of(seed: int) -> UnreducedProblem:
    """The unreduced problem of a way-point task."""
    cell = way_task(seed).cell
    return unreduced_problem(cell, cell.arms[0], search_box(cell, cell.arms[0]))


def under_turned_bases(problem: UnreducedProblem) -> Seeds:
    """One arm in space, over bases that are turned by `TURNS` about the axis of its first joint, which points down."""
    rng = np.random.default_rng(1)
    joints = rng.uniform(-1.0, 1.0, (problem.dof, len(problem.positions), 1)).repeat(len(TURNS), axis=2)
    joints[0] += TURNS
    bases = np.tile([0.3, 0.1, 0.0, 0.2], (len(TURNS), 1))
    bases[:, 3] += TURNS
    return Seeds(joints, bases)


def kept(problem: UnreducedProblem, seeds: Seeds) -> int:
    """How many of them are distinct."""
    return len(distinct(problem, seeds, np.arange(len(seeds)), len(seeds), 0.15, 0.03))


def test_arms_that_stand_alike_in_space_are_one_whatever_the_yaw_of_the_base_under_them() -> None:
    problem = problem_of(GEN3)
    seeds = under_turned_bases(problem)
    found = figures(problem, seeds)
    assert found.cost == pytest.approx(found.cost[0])
    assert found.error == pytest.approx(found.error[0], abs=1e-3)  # the robot's file is rounded
    assert kept(problem, seeds) == 1


def test_whole_turns_of_a_joint_without_end_make_no_other_arm_and_half_turns_do() -> None:
    problem = problem_of(GEN3)
    seeds = under_turned_bases(problem)
    seeds.joints[2] += 2.0 * np.pi * np.arange(len(TURNS))
    assert kept(problem, seeds) == 1
    seeds.joints[4] += np.pi * (np.arange(len(TURNS)) % 2)
    assert kept(problem, seeds) == 2


def test_where_the_first_joint_has_limits_and_costs_all_are_kept() -> None:
    problem = problem_of(IIWA14)
    assert kept(problem, under_turned_bases(problem)) == len(TURNS)


def test_copies_of_one_layout_do_not_push_a_better_one_out_of_the_list() -> None:
    """Ten copies of a layout at 106.06 filled it; the known value is what another seed of the draws once led to."""
    layout = optimize(way_task(GEN3).cell, Settings(certificate=None))
    assert_ended(layout)
    assert layout.objective is not None
    assert layout.objective <= 103.2613
