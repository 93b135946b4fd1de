"""Local solves with rows only where they are needed: they then hold, cost something, and the posture stays."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import signs_of
from duocell.models.robot.arm import Arm
from duocell.optimizer.nlp.measure import placed
from duocell.optimizer.nlp.program import ArmSolution, Cuts, Program, build_program
from duocell.optimizer.nlp.solve import Solve, SolveStatus
from duocell.optimizer.optimize import optimize
from duocell.optimizer.single_arm import local
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.verification.verify import check
from tests.support.given.acceptance import load
from tests.support.given.arms import form_of
from tests.support.given.fields import ArmFields
from tests.support.given.tasks import Possible, possible
from tests.support.given.witness import witness_of
from tests.support.present import present


def started(name: str, seed: int = 0, **given: Unpack[ArmFields]) -> tuple[Possible, ArmSolution]:
    task = possible(name, np.random.default_rng(seed), half=(0.3, 0.3, 0.0, np.pi), **given)
    return task, witness_of(task)


def solved(cell: Cell, arm: Arm, start: ArmSolution) -> Solve:
    return solve_locally(cell, arm, start, time.perf_counter() + 60.0)


Built = list[tuple[bool, bool, bool]]
"""Whether a program has rows for the shoulder, for steps, and cuts."""


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> Built:
    """The kinds of rows of every program that is stated."""
    kinds: Built = []

    def spy(
        cell: Cell,
        arms: Sequence[Arm],
        points: Sequence[ArmSolution],
        *,
        keep_shoulder: bool = False,
        steps: bool = False,
        clear: bool = False,
        cuts: Sequence[Cuts] | None = None,
    ) -> Program:
        kinds.append((keep_shoulder, steps, cuts is not None))
        return build_program(cell, arms, points, keep_shoulder=keep_shoulder, steps=steps, clear=clear, cuts=cuts)

    monkeypatch.setattr(local, "build_program", spy)
    return kinds


@pytest.mark.parametrize(("name", "seed"), [("puma560", 1), ("ur10e", 0), ("iiwa14", 2)])
def test_rows_that_are_not_needed_are_not_added(name: str, seed: int, built: Built) -> None:
    task, start = started(name, seed)
    result = solved(task.cell, task.arm, start)
    assert result.status is SolveStatus.OPTIMAL
    assert built == [(start.signs is not None, False, False)]


def test_no_rows_are_added_to_what_is_beaten_without_them(built: Built) -> None:
    task, start = started("iiwa14", 2)
    free = solved(task.cell, task.arm, start)
    bent = replace(task.cell, max_joint_step=0.5 * float(np.max(np.abs(np.diff(free.points[0].joints, axis=0)))))
    built.clear()
    beaten = solve_locally(bent, task.arm, start, time.perf_counter() + 60.0, 0.9 * free.objective)
    assert built == [(False, False, False)]
    assert not check(bent, task.arm, beaten.points[0]).usable
    held = solve_locally(bent, task.arm, start, time.perf_counter() + 60.0, 1.1 * free.objective)
    assert built[-1] == (False, True, False)
    assert check(bent, task.arm, held.points[0]).usable


@pytest.mark.parametrize(("name", "seed"), [("puma560", 0), ("ur10e", 0), ("iiwa14", 2)])
def test_joint_steps_are_limited_where_the_answer_exceeds_them(name: str, seed: int, built: Built) -> None:
    task, start = started(name, seed)
    free = solved(task.cell, task.arm, start)
    longest = np.abs(np.diff(free.points[0].joints, axis=0)).max()
    cell = replace(task.cell, max_joint_step=0.97 * longest)
    held = solved(cell, task.arm, start)
    assert held.status is SolveStatus.OPTIMAL
    assert check(cell, task.arm, held.points[0]).usable
    assert np.abs(np.diff(held.points[0].joints, axis=0)).max() <= cell.max_joint_step + 1e-9
    assert held.objective >= free.objective * (1.0 - 1e-9)
    assert [steps for _, steps, _ in built] == [False, False, True]


@pytest.mark.parametrize(("name", "seed"), [("ur10e", 7), ("puma560", 0), ("iiwa14", 0)])
def test_conditioning_that_is_asked_for_holds_and_costs_no_more_than_needed(name: str, seed: int, built: Built) -> None:
    """With the mid-range for a reference, which draws arms towards straight elbows and wrists."""
    task, start = started(name, seed)
    arm = replace(task.arm, reference=0.5 * (task.arm.lower + task.arm.upper))
    free = solved(task.cell, arm, start)
    before, witness = (placed(task.cell, arm, p).minimum_conditioning for p in (free.points[0], start))
    asked = replace(arm, min_conditioning=0.5 * (before + witness))
    assert before < present(asked.min_conditioning) < witness
    held = solved(task.cell, asked, start)
    assert check(task.cell, asked, held.points[0]).usable
    reached = placed(task.cell, asked, held.points[0]).minimum_conditioning
    assert reached >= present(asked.min_conditioning) - 1e-9
    assert reached == pytest.approx(asked.min_conditioning, rel=1e-3)  # the constraint is active
    assert free.objective < held.objective < float(np.sum(arm.weights * (start.joints - arm.reference) ** 2))
    assert built[0][2] is False
    assert built[-1][2] is True


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900", "rx160", "j2s6s300", "z1"])
def test_the_posture_of_the_start_is_kept(name: str) -> None:
    for seed in range(4):
        task, start = started(name, seed)
        point = solved(task.cell, task.arm, start).points[0]
        assert point.signs == start.signs
        signs = signs_of(form_of(task.arm.robot), point.joints)
        assert np.all((signs == start.signs) | (signs == 0))


def test_a_deadline_in_the_past_still_returns_an_answer() -> None:
    task, start = started("puma560")
    result = solve_locally(task.cell, task.arm, start, time.perf_counter() - 1.0)
    assert result.points[0].joints.shape == start.joints.shape


def test_conditioning_that_cannot_be_had_is_not_claimed() -> None:
    task, start = started("ur10e", 1)
    arm = replace(task.arm, min_conditioning=0.9)
    result = solved(task.cell, arm, start)
    assert not (result.status.has_point and check(task.cell, arm, result.points[0]).usable)


@pytest.mark.parametrize(
    ("case", "wanted", "known"),
    [
        ("line", 0.05, 160.531),
        ("line", 0.12, 260.474),
        ("arc", 0.08, 235.868),
        ("arc", 0.15, 362.896),
    ],
)
def test_the_best_known_objectives_of_a_thinned_out_search_are_found(case: str, wanted: float, known: float) -> None:
    """A conditioning that is asked for thins the usable bases out; these values are the best seen by any version."""
    cell, _ = load(case)
    asked = replace(cell, arms=tuple(replace(arm, min_conditioning=wanted) for arm in cell.arms))
    layout = optimize(asked)
    assert layout.objective is not None
    assert layout.objective <= 1.003 * known
    assert all(p.minimum_conditioning >= wanted - 1e-9 for p in layout.placements)
