"""Station tasks: the draw, the random search beside it, and a sample of the trial."""

from __future__ import annotations

import numpy as np

from bench.draws.station_draw import KINDS, station_task
from bench.judges.dense_check import dense_check
from bench.trials.stations import attempt, random_search, summary, verdict
from bench.trials.trial import Record, draw_of
from duocell.optimizer.settings import Settings

STEPS = 5e-3, 0.02


def test_tasks_are_made_around_a_layout() -> None:
    for seed in range(len(KINDS)):
        task = station_task(seed)
        assert task.kind == list(KINDS)[seed]
        assert len(task.cell.task.segments) == 5
        assert dense_check(task.cell, task.stand[None], [task.joints], *STEPS).clean
    again = station_task(len(KINDS) - 1)
    assert np.array_equal(again.joints, task.joints)


def test_what_the_random_search_finds_is_clean() -> None:
    task = station_task(0)
    found = random_search(task, 60.0, draw_of("stations random", 0), most=20000)
    assert found.stand is not None
    assert found.joints is not None
    assert dense_check(task.cell, found.stand[None], [found.joints], *STEPS).clean
    nothing = random_search(task, 60.0, draw_of("stations random", 0), most=0)
    assert (nothing.stand, nothing.tried) == (None, 0)


def test_a_sample_of_the_trial() -> None:
    record = {"seed": 7, **attempt(7, Settings(time_limit=120.0, certificate=None))}
    assert verdict(record) == ""
    assert "| cross | 1 | 1 |" in summary([record])


def test_verdicts() -> None:
    record: Record = {"word": "infeasible", "objective": None, "faults": [], "random": False, "detail": "why"}
    assert verdict(record) == "WRONG NO"
    assert verdict(record | {"word": "unknown"}) == "missed by both"
    assert verdict(record | {"word": "unknown", "random": True}) == "MISSED, random has it"
    assert verdict(record | {"word": "error"}) == "ERROR why"
    assert verdict(record | {"word": "feasible", "objective": 1.0, "faults": ["deep"]}) == "UNSOUND deep"
