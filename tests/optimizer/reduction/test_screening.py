"""Screening: candidates are what they say, distinct, improved, repeatable, and near the best base there is."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.cell.task import Task
from duocell.models.robot.posture import ALL_SIGNS, Posture
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate, evaluate_signed, reduced_problem
from duocell.optimizer.reduction.screening import Candidate, distinct, improve, mixed, on_whole_task, scored, screen
from tests.support.given.arms import region
from tests.support.given.fields import PossibleFields
from tests.support.given.tasks import Possible, possible
from tests.support.present import present


def problem_of(name: str, seed: int = 0, **given: Unpack[PossibleFields]) -> tuple[Possible, ReducedProblem, Floats]:
    task = possible(name, np.random.default_rng(seed), **given)
    return task, present(reduced_problem(task.cell, task.arm)), search_box(task.cell, task.arm)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900"])
def test_candidates_are_what_the_reduced_problem_says_of_them(name: str) -> None:
    _, problem, box = problem_of(name)
    found = screen(problem, box, 0)
    assert found.candidates
    for candidate in found.candidates:
        paths = evaluate_signed(problem, candidate.position[None], np.array([candidate.signs]))
        assert candidate.objective == pytest.approx(paths.objective[0, 0], rel=1e-9)
        assert candidate.violation == pytest.approx(paths.violation[0, 0], abs=1e-12)
        assert np.all(candidate.position >= box[:, 0])
        assert np.all(candidate.position <= box[:, 1])
    scores = [scored(found.problem, c) for c in found.candidates]
    assert scores == sorted(scores)


@pytest.mark.parametrize("name", ["puma560", "ur5e", "rx160", "j2s6s300"])
def test_the_best_candidate_is_close_to_the_best_of_a_dense_grid(name: str) -> None:
    for seed in range(3):
        _, problem, box = problem_of(name, seed, half=(0.4, 0.4, 0.0, np.pi))
        grid = np.stack(np.meshgrid(*(np.linspace(low, high, 60) for low, high in box[:2]), [box[2, 0]]), -1).reshape(
            -1, 3
        )
        paths = evaluate(problem, grid)
        best = paths.objective[paths.violation == 0.0].min()
        found = [c.objective for c in screen(problem, box, 0).candidates if c.violation == 0.0]
        assert min(found) <= 1.02 * best


def test_later_rounds_look_at_more_and_other_points() -> None:
    _, problem, box = problem_of("puma560")
    first, second = screen(problem, box, 0, 0), screen(problem, box, 0, 1)
    assert second.evaluated == 4 * first.evaluated
    assert second.problem.penalty > first.problem.penalty


def test_the_same_seed_gives_the_same_candidates() -> None:
    _, problem, box = problem_of("ur10e")
    one, two = screen(problem, box, 3), screen(problem, box, 3)
    for a, b in zip(one.candidates, two.candidates, strict=True):
        assert np.array_equal(a.position, b.position)
        assert (a.signs, a.objective, a.violation) == (b.signs, b.objective, b.violation)


def test_only_postures_that_are_asked_for_are_candidates() -> None:
    task, _, box = problem_of("puma560")
    arm = replace(task.arm, posture=Posture(elbow=-1))
    found = screen(present(reduced_problem(task.cell, arm)), box, 0)
    assert {c.signs[1] for c in found.candidates} == {-1}
    everything = screen(present(reduced_problem(task.cell, task.arm)), box, 0)
    assert everything.evaluated == 2 * found.evaluated


def test_a_fixed_base_is_one_point_with_its_postures() -> None:
    task, _, _ = problem_of("puma560")
    arm = replace(task.arm, base=region(*task.position))
    found = screen(present(reduced_problem(task.cell, arm)), search_box(task.cell, arm), 0)
    assert found.evaluated == 8
    assert len({c.signs for c in found.candidates}) == len(found.candidates) <= 8
    assert all(np.array_equal(c.position, task.position) for c in found.candidates)


def test_candidates_of_one_posture_stand_apart() -> None:
    _, problem, box = problem_of("ur10e")
    candidates = screen(problem, box, 0).candidates
    spacing = np.array([0.2, 0.2, 0.2])
    kept = distinct(candidates, spacing)
    assert kept[0] is candidates[0]
    for i, a in enumerate(kept):
        for b in kept[:i]:
            assert a.signs != b.signs or np.any(np.abs(a.position - b.position) > spacing)
    for dropped in (c for c in candidates if c not in kept):
        assert any(dropped.signs == k.signs and np.all(np.abs(dropped.position - k.position) <= spacing) for k in kept)


def test_improvement_never_makes_a_candidate_worse() -> None:
    _, problem, box = problem_of("puma560", 1)
    found = screen(problem, box, 0)
    start, spacing = found.candidates, np.array([0.05, 0.05, 0.0])
    better = improve(problem, start, found.frame, spacing, 4)
    for before, after in zip(start, better, strict=True):
        assert after.signs == before.signs
        assert scored(problem, after) <= scored(problem, before) + 1e-9
    assert improve(problem, [], found.frame, spacing, 4) == []


def test_order_of_signs_is_that_of_the_branches() -> None:
    _, problem, box = problem_of("puma560")
    for candidate in screen(problem, box, 0).candidates:
        paths = evaluate(problem, candidate.position[None])
        k = ALL_SIGNS.index(candidate.signs)
        assert paths.objective[k, 0] == pytest.approx(candidate.objective, rel=1e-9)


def test_no_posture_takes_more_than_its_share_while_there_are_others() -> None:
    one, other = ALL_SIGNS[:2]
    candidates = [Candidate(np.zeros(3), signs, float(k), 0.0) for k, signs in enumerate([one] * 4 + [other] * 2)]
    assert [c.objective for c in mixed(candidates, 4, 2)] == [0.0, 1.0, 4.0, 5.0]
    assert [c.objective for c in mixed(candidates, 5, 2)] == [0.0, 1.0, 4.0, 5.0, 2.0]
    assert mixed(candidates[:4], 3, 2) == candidates[:3]


def test_of_a_dwelling_task_the_best_of_many_bases_on_all_poses_is_bettered() -> None:
    """A sample of the poses says little about a task that stays in one place for most of its time."""
    task = possible("ur10e", np.random.default_rng(4), half=(0.4, 0.4, 0.0, np.pi))
    stays = Task(np.repeat(task.cell.task.poses, [1] * (len(task.cell.task) - 1) + [150], axis=0))
    problem, box = present(reduced_problem(replace(task.cell, task=stays), task.arm)), search_box(task.cell, task.arm)
    found = screen(problem, box, 0)
    assert len(found.problem.positions) < len(problem.positions)
    best = min(c.objective for c in on_whole_task(problem, found.candidates) if c.violation == 0.0)
    points = box[:, 0] + (box[:, 1] - box[:, 0]) * np.random.default_rng(0).random((60, 3))
    paths = evaluate(problem, points)
    assert best <= np.min(np.where(paths.violation == 0.0, paths.objective, np.inf))
