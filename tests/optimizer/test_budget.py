"""How much an automatic proof may cost."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.cell.surroundings import Clearances, Surroundings
from duocell.optimizer.budget import GAP, LEAST, automatic, boxes_for, search_time
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.settings import CertificateSettings
from tests.support.given.acceptance import load
from tests.support.present import present

LINE, _ = load("line")


def test_budget_counts_boxes_and_grows_with_what_a_search_costs() -> None:
    alone, together = automatic(LINE, 7.0), automatic(replace(LINE, surroundings=_clear()), 7.0)
    assert (alone.gap, alone.time_limit) == (GAP, 7.0)
    assert alone.boxes == boxes_for(LEAST, len(LINE.task))
    assert together.boxes is not None
    assert alone.boxes is not None
    worth = max(search_time(replace(LINE, surroundings=_clear())), LEAST)
    assert together.boxes == boxes_for(worth, len(LINE.task), coupled=True)
    assert boxes_for(1.0, 10, coupled=True) < boxes_for(1.0, 10)
    assert search_time(replace(LINE, surroundings=_clear())) > search_time(LINE)
    assert boxes_for(1.0, 1000) < boxes_for(1.0, 10)


def test_one_arm_among_its_surroundings_is_worth_less_while_a_layout_is_known() -> None:
    one = replace(LINE, arms=LINE.arms[:1], surroundings=_clear())
    pair = replace(LINE, surroundings=_clear())
    found, nothing = automatic(one, 7.0), automatic(one, 7.0, found=False)
    assert len(pair.arms) > 1
    assert found.boxes is not None
    assert nothing.boxes is not None
    assert search_time(one) < search_time(pair)
    assert nothing.boxes > 4 * found.boxes


@pytest.mark.parametrize("boxes", [1, 500, 777])
def test_tree_stops_at_its_number_of_boxes_whatever_the_clock_says(boxes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = present(reduced_problem(LINE, LINE.arms[0]))
    settings = CertificateSettings(1e-6, 1e9, boxes)
    proof = certify(problem, None, settings)
    ticks = iter(np.arange(1e7))  # a second passes whenever somebody looks at the clock
    monkeypatch.setattr(time, "perf_counter", lambda: float(next(ticks)))
    slow = certify(problem, None, settings)
    assert proof.boxes == slow.boxes == boxes
    assert not proof.proved
    assert proof.lower_bound == slow.lower_bound


def _clear() -> Surroundings:
    return Surroundings(clearances=Clearances(arm_arm=0.03))
