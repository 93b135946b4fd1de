"""One iteration is the dense least-squares step; where it ends, no feasible direction leads down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.single_arm.redundant.gauss_newton import Iterations, gauss_newton
from duocell.optimizer.single_arm.redundant.ranking import figures
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, unreduced_problem
from tests.support.given.tasks import Possible, possible
from tests.support.oracles.answers import reached

TILTED = rotation_about((1.0, 2.0, -0.5), 0.8)


def at_witness(task: Possible, offset: float = 0.0) -> tuple[UnreducedProblem, Seeds]:
    """The problem of a possible task, and its witness as one seed."""
    problem = unreduced_problem(task.cell, task.arm, search_box(task.cell, task.arm))
    base = np.array([*(task.position - problem.origin), task.yaw])
    return problem, Seeds(task.joints.T[:, :, None] + offset, base[None])


@pytest.mark.parametrize("mount", [np.eye(3), TILTED], ids=["upright", "tilted"])
def test_the_errors_of_the_seeds_are_those_of_the_layout(mount: Floats) -> None:
    task = possible("iiwa14", np.random.default_rng(5), poses=3, mount=mount)
    problem, seeds = at_witness(task)
    assert figures(problem, seeds).error[0] < 1e-9
    moved = Seeds(seeds.joints, seeds.bases + np.array([[0.01, -0.02, 0.0, 0.3]]))
    point = problem.point(moved.joints[:, :, 0], moved.bases[0])
    found = reached(task.arm, point.position, point.yaw, point.joints[1])
    away = np.abs(found[:3, 3] - task.cell.task.poses[1, :3, 3]).max()
    assert figures(problem, moved).error[0] > 0.9 * away


@pytest.mark.parametrize("mount", [np.eye(3), TILTED], ids=["upright", "tilted"])
def test_seeds_arrive_with_moving_bases(mount: Floats) -> None:
    task = possible("franka_panda", np.random.default_rng(6), poses=4, step=0.06, mount=mount)
    problem, seeds = at_witness(task, offset=0.05)
    assert figures(problem, seeds).error[0] > 0.01
    assert figures(problem, gauss_newton(problem, seeds, Iterations(12, 0.0, 300.0))).error[0] < 1e-6


@pytest.mark.parametrize("name", ["iiwa14", "fanuc_crx10ia"])
def test_where_iterations_end_a_local_solve_has_little_to_add(name: str) -> None:
    task = possible(name, np.random.default_rng(7), poses=5, step=0.06, half=(0.1, 0.1, 0.0, np.pi))
    problem, seeds = at_witness(task)
    end = gauss_newton(problem, seeds, Iterations(60, 0.5, 300.0, steps=True, restraint=5e-3))
    reached_cost = figures(problem, end).cost[0] * len(task.cell.task) * task.arm.weight_scale
    solved = solve_locally(task.cell, task.arm, problem.point(end.joints[:, :, 0], end.bases[0]), np.inf)
    assert reached_cost == pytest.approx(solved.objective, rel=5e-3)
    assert reached_cost < figures(problem, seeds).cost[0] * len(task.cell.task) * task.arm.weight_scale


def test_a_seed_does_not_depend_on_what_is_solved_beside_it() -> None:
    task = possible("iiwa14", np.random.default_rng(8), poses=4, half=(0.2, 0.2, 0.1, 0.5))
    problem, one = at_witness(task)
    rng = np.random.default_rng(9)
    others = [Seeds(one.joints + rng.normal(0.0, 0.3, one.joints.shape), one.bases) for _ in range(6)]
    many = one
    for other in others:
        many = many.join(other)
    how = Iterations(5, 0.5, 300.0, steps=True)
    together, alone = gauss_newton(problem, many, how), gauss_newton(problem, others[2], how)
    assert np.allclose(together.joints[:, :, 3], alone.joints[:, :, 0], atol=1e-9)
    assert np.allclose(together.bases[3], alone.bases[0], atol=1e-9)


def test_steps_are_kept_where_a_seed_breaks_them() -> None:
    task = possible("iiwa14", np.random.default_rng(10), poses=4, step=0.05)
    problem, seeds = at_witness(task)
    problem = replace(problem, max_step=0.5)
    broken = seeds.joints.copy()
    broken[2, 2:] += 0.8
    how = Iterations(30, 0.3, 300.0, base_moves=False)
    seeds = Seeds(broken, seeds.bases)
    with_steps = figures(problem, gauss_newton(problem, seeds, replace(how, steps=True)))
    assert with_steps.step[0] < 0.55
    assert with_steps.error[0] < 1e-3
