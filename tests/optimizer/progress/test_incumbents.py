"""Incumbents: told when they are better, with where the arms stand, and nowhere else."""

from __future__ import annotations

import json
import time
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.cell.coupling import SameHeight
from duocell.optimizer.monitoring.events import Event, Incumbent
from duocell.optimizer.monitoring.watch import watching
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from duocell.optimizer.progress.incumbents import arm_found, layout_found, recording
from duocell.optimizer.settings import Settings
from duocell.service.workers.reports import text_of
from tests.support.given.acceptance import load
from tests.support.present import present

LINE, _ = load("line")
POINT = ArmSolution(np.array([0.1, 0.2, 0.0]), 0.5, np.zeros((len(LINE.task), 6)), (1, 1, 1))
ASIDE = replace(POINT, position=np.array([0.1, 1.2, 0.0]))


def test_better_layouts_are_told_and_others_are_not() -> None:
    told: list[Event] = []
    with watching(told.append, lambda: False), recording(LINE, time.perf_counter()) as seen:
        for objective in (5.0, 6.0, 5.0 * (1.0 - 1e-9), 4.0):
            layout_found((POINT, ASIDE), objective)
        first = seen.first_time
        layout_found((POINT, POINT), 1.0)  # in one place
    layout_found((POINT, ASIDE), 1.0)  # nobody records
    assert [event.objective for event in told if isinstance(event, Incumbent)] == [5.0, 4.0]
    assert first is not None
    assert first >= 0.0
    assert seen.objective == 4.0


def test_arms_by_themselves_count_once_all_are_placed_and_only_where_nothing_couples_them() -> None:
    main, follower = LINE.arms
    tied = replace(LINE, couplings=(SameHeight((0, 1)),))
    for cell, counted in ((LINE, True), (tied, False)):
        with recording(cell, 0.0) as seen:
            arm_found(cell, main, POINT, 2.0)
            assert seen.objective is None
            arm_found(cell, follower, ASIDE, 3.0)
            arm_found(cell, main, POINT, 2.5)
            assert seen.objective == (5.0 if counted else None)
            arm_found(replace(cell), main, POINT, 1.0)  # another cell
            assert seen.objective == (5.0 if counted else None)


def test_the_last_incumbent_of_a_solve_is_its_answer() -> None:
    told: list[Event] = []
    with watching(told.append, lambda: False):
        layout = optimize(LINE, Settings(certificate=None))
    last = [event for event in told if isinstance(event, Incumbent)][-1]
    assert last.objective == pytest.approx(layout.objective)
    assert 0.0 < present(layout.search.first_feasible_time) <= layout.search.wall_time + 1.0
    said = json.loads(text_of(last))
    for arm, placement in zip(said["arms"], layout.placements, strict=True):
        assert arm["name"] == placement.arm
        assert arm["base"]["position"] == pytest.approx(placement.position)
        assert arm["base"]["yaw"] == pytest.approx(placement.yaw)
        assert arm["posture"] == placement.posture
        assert arm["objective"] == pytest.approx(placement.objective)
