"""The whole explanation: in time, and only where it is asked for."""

from __future__ import annotations

import time

from bench.draws.cells import real_cell
from bench.judges.dense_check import judge
from duocell.optimizer.advice import with_advice
from duocell.optimizer.infeasibility.explain import explain
from duocell.optimizer.infeasibility.searched.trial import clean
from duocell.optimizer.optimize import optimize
from duocell.optimizer.progress.timetable import timetable
from duocell.optimizer.results.findings import Explanation
from duocell.optimizer.results.layout import Outcome
from duocell.optimizer.settings import Settings, ToleranceSettings
from duocell.optimizer.verification.scene import Scene
from tests.support.given.arms import region
from tests.support.given.blocked import (
    NOTHING,
    carried,
    far_box,
    one_arm,
)


def test_the_time_limit_is_respected() -> None:
    cell = real_cell(43).cell
    began = time.perf_counter()
    found = explain(cell, NOTHING, 0, began + 1.0)
    assert time.perf_counter() - began < 6.0  # one search that is under way is finished
    assert isinstance(found, Explanation)
    assert found.blocking


def test_a_layout_that_turns_up_is_the_answer() -> None:
    cell = one_arm(task=carried(3), obstacles=(far_box(),))
    found = explain(cell, NOTHING, 0, time.perf_counter() + 60.0)
    assert isinstance(found, tuple)
    assert clean(Scene.of(cell), found)
    settings = Settings(explain=True, tolerance=ToleranceSettings())
    rescued = with_advice(cell, NOTHING, settings, timetable(cell, settings))
    assert rescued.outcome is Outcome.FEASIBLE
    assert rescued.tolerance is not None
    assert judge(cell, rescued).clean


def test_an_impossible_cell_is_explained_if_asked() -> None:
    cell = one_arm(task=carried(4), base=region((1.9, 2.0), (-0.1, 0.1)))
    assert optimize(cell).explanation is None
    found = optimize(cell, Settings(explain=True)).explanation
    assert found is not None
    assert "base region of main" in found.blocking


def test_a_possible_cell_is_not_explained() -> None:
    layout = optimize(one_arm(task=carried(3)), Settings(explain=True, tolerance=ToleranceSettings()))
    assert layout.explanation is None
    assert layout.tolerance is not None
