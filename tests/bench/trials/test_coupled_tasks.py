"""Drawn tasks have the layout they were drawn around, ties are kept by construction, and the long search finds it."""

from __future__ import annotations

import numpy as np
import pytest

from bench.judges.dense_check import dense_check
from bench.judges.dense_rules import coupling_excess
from bench.searches.long_search import long_search
from bench.searches.own_ties import free_bases
from bench.trials.coupled_tasks import KINDS, RIGID, coupled_task, say, summary
from duocell.optimizer.optimize import optimize
from duocell.optimizer.settings import Settings


@pytest.mark.parametrize("seed", range(len(KINDS)))
def test_the_drawn_layout_works(seed: int) -> None:
    task = coupled_task(seed)
    assert task.kind == KINDS[seed] == task.cell.couplings[0].kind
    assert dense_check(task.cell, task.known.stands, task.known.joints, 0.02, 0.05).faults == []


@pytest.mark.parametrize("seed", [RIGID, RIGID + 7])
def test_two_arms_on_one_stand_are_never_answered_worse_than_they_were_drawn(seed: int) -> None:
    task = coupled_task(seed)
    assert task.kind == "rigid" == task.cell.couplings[0].kind
    assert dense_check(task.cell, task.known.stands, task.known.joints, 0.02, 0.05).faults == []
    layout = optimize(task.cell, Settings(time_limit=120.0))
    drawn = sum(
        float(np.sum(arm.weights * (q - arm.reference) ** 2))
        for arm, q in zip(task.cell.arms, task.known.joints, strict=True)
    )
    assert layout.objective is not None
    assert layout.objective <= drawn
    stands = np.array([[*placement.position, placement.yaw] for placement in layout.placements])
    assert coupling_excess(task.cell.couplings[0], stands) < 1e-5


@pytest.mark.parametrize("seed", [*range(len(KINDS)), RIGID, RIGID + 7])
def test_ties_are_kept_by_construction(seed: int) -> None:
    cell = coupled_task(seed).cell
    free = free_bases(cell)
    numbers = np.random.default_rng(seed).uniform(free.bounds[:, 0], free.bounds[:, 1], (20, len(free.bounds)))
    places, yaws, _ = free.places(numbers)
    yaws = np.zeros((2, 20)) if yaws is None else yaws
    stands = np.concatenate([places, yaws[..., None]], axis=2)
    assert max(coupling_excess(cell.couplings[0], stands[:, k]) for k in range(20)) < 1e-9


def test_the_long_search() -> None:
    task = coupled_task(2)
    found = long_search(task.cell, 1.0, np.random.default_rng(0))
    assert found.layout is not None
    assert found.objective is not None
    drawn = sum(
        float(np.sum(arm.weights * (q - arm.reference) ** 2))
        for arm, q in zip(task.cell.arms, task.known.joints, strict=True)
    )
    assert found.objective < drawn
    assert dense_check(task.cell, found.layout.stands, found.layout.joints, 0.02, 0.05).faults == []


def test_what_is_printed() -> None:
    one = {"seed": 0, "kind": "rail", "robots": ["ur5e"], "word": "optimal", "objective": 2.0, "cpu": 1.0, "long": 1.0}
    two = one | {"word": "infeasible", "objective": None}
    assert "WORSE x 2" in say(one | {"worse": True})
    assert "WRONG NO" in say(two | {"worse": True})
    assert "| rail | 2 | 1 | 1 | 0 | 0 |" in summary([one | {"worse": True}, two | {"worse": True}])
