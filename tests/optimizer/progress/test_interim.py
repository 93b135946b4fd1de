"""A solve that would not end in time: what is known is the answer, and what is missing in it is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NoReturn

import numpy as np
import pytest

import duocell.optimizer.advice
import duocell.optimizer.infeasibility.explain
import duocell.optimizer.optimize
from duocell.models.cell.cell import Cell
from duocell.optimizer.monitoring.watch import OutOfTime
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import Settings, ToleranceSettings
from tests.support.given.arms import region
from tests.support.given.blocked import carried, far_box, one_arm
from tests.support.given.tasks import possible


def out_of_time(*arguments: object, **named: object) -> NoReturn:
    raise OutOfTime


def limit_reached(layout: Layout) -> str:
    (detail,) = [reason.detail for reason in layout.reasons if reason.kind == "limit_reached"]
    return detail


def plain() -> Cell:
    return possible("puma560", np.random.default_rng(3), poses=4, step=0.12, half=(0.2, 0.2, 0.0, np.pi)).cell


@pytest.mark.parametrize("make", [plain, lambda: one_arm(task=carried(3), obstacles=(far_box(),))])
def test_the_best_layout_so_far_is_checked_and_says_what_is_missing(
    make: Callable[[], Cell], monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = make()
    whole = optimize(cell, Settings(certificate=None))
    monkeypatch.setattr(duocell.optimizer.optimize, "prove", out_of_time)
    cut = optimize(cell, Settings(tolerance=None, alternatives=0))
    assert cut.outcome is Outcome.FEASIBLE
    assert cut.objective == pytest.approx(whole.objective, rel=1e-9)
    assert not cut.search.ended
    assert cut.search.first_feasible_time is not None
    assert [one.kind for one in cut.clearances] == [one.kind for one in whole.clearances]
    for one, other in zip(cut.clearances, whole.clearances, strict=True):
        assert one.distance == pytest.approx(other.distance, abs=1e-6)
    assert cut.verification is not None
    assert "not computed, and null or empty here: certificate; allow more time" in limit_reached(cut)


def test_without_any_layout_it_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(duocell.optimizer.optimize, "search_arm", out_of_time)
    layout = optimize(plain(), Settings(time_limit=7.0))
    assert (layout.outcome, layout.placements, layout.certificate) == (Outcome.UNKNOWN, (), None)
    assert "7 s" in limit_reached(layout)
    assert "certificate" in limit_reached(layout)


def test_a_tolerance_that_takes_too_long_is_named_and_costs_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(duocell.optimizer.advice, "tolerance_of", out_of_time)
    layout = optimize(plain(), Settings(tolerance=ToleranceSettings()))
    assert layout.usable
    assert layout.certificate is not None
    assert layout.tolerance is None
    assert "tolerance" in limit_reached(layout)


def test_of_an_explanation_that_is_cut_is_kept_what_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = one_arm(task=carried(4), base=region((1.9, 2.0), (-0.1, 0.1)))
    settings = Settings(explain=True)
    whole = optimize(cell, settings)
    monkeypatch.setattr(duocell.optimizer.infeasibility.explain, "remedies", out_of_time)
    cut = optimize(cell, settings)
    assert whole.explanation is not None
    assert cut.explanation is not None
    assert cut.explanation.blocking == whole.explanation.blocking
    assert cut.explanation.relaxations == ()
    assert "explanation" in limit_reached(cut)
    assert replace(cut, reasons=(), explanation=None).outcome is whole.outcome
