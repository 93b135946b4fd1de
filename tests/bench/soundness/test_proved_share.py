"""A cell with a layout and one without are judged, and the summary counts them apart."""

from __future__ import annotations

import numpy as np
import pytest

from bench.draws.cells import real_cell
from bench.draws.known_cells import BEAM, DOOR, numbered_cell
from bench.soundness.proved_share import attempt, known_objective, limits, summary, verdict
from bench.trials.trial import Answer, Record


def record(name: str = "cell 01", **values: object) -> Record:
    empty = {"kind": "open", "word": "optimal", "objective": 2.0, "known": 3.0, "bound": 1.99, "gap": 0.005, "boxes": 7}
    times = {"cpu": 2.0, "search_cpu": 1.5, "proof_cpu": 0.5, "ended": True, "alone": [1.0, 0.5], "notes": []}
    return {"name": name, "faults": [], "ties": [], "detail": ""} | empty | times | values


def test_cells_have_numbers() -> None:
    assert numbered_cell(7) is real_cell(7)
    assert [numbered_cell(n).name for n in (BEAM, DOOR)] == ["beam cell", "door cell"]
    assert [arm.robot.name for arm in numbered_cell(DOOR).cell.arms] == ["ur10e", "ur10e"]


def test_a_blocked_cell_is_refused() -> None:
    found = attempt(numbered_cell(53), limit=20.0)
    assert (found["word"], found["known"], verdict(found)) == ("infeasible", None, "")


def test_the_drawn_layout_speaks_against_a_no(monkeypatch: pytest.MonkeyPatch) -> None:
    no = Answer("infeasible", None, 1.0, 1.0, None, "", None)
    monkeypatch.setattr("bench.soundness.proved_share.ask", lambda cell, settings: no)
    real = real_cell(79)
    found = attempt(real)
    assert verdict(found) == "WRONG NO"
    assert real.known is not None
    drawn = [
        np.sum(arm.weights * (q - arm.reference) ** 2) for arm, q in zip(real.cell.arms, real.known.joints, strict=True)
    ]
    assert found["known"] == known_objective(real) == sum(drawn)


def test_what_is_counted() -> None:
    some = [
        record(),
        record("cell 02", word="feasible", bound=1.6, gap=0.2, ended=False, ties=["rail"]),
        record("cell 03", word="infeasible", kind="blocked", objective=None, known=None, bound=None, gap=None),
        record("cell 04", word="infeasible", objective=None),
        record("cell 05", bound=3.1),
    ]
    text = summary(some)
    assert "with a layout: 4, optimal 2 (50.0%)" in text
    assert "without: 1, infeasible 1" in text
    assert "- cell 04 infeasible: WRONG NO" in text
    assert "BOUND ABOVE A LAYOUT OF 3" in text
    assert limits(some[1]) == "arms alone 1.5, together 1.6 of 2, tied by rail; cut by time"
