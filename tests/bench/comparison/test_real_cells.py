"""Answers are judged, refusals are held against known layouts and searches, and the page keeps its other sections."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bench.comparison import cell_tables, real_cells, report
from bench.comparison.real_cells import FOUND, KNOWN, NONE, BeamResult, CellResult, run_cell
from bench.draws.cells import real_cell
from bench.judges.exhaustive import Exhausted
from duocell.models.cell.cell import Cell
from duocell.optimizer.settings import Settings
from tests.support.present import present

TOO_LATE = Exhausted(None, False, (9, 9), (0, 0), (0, 0), 0, 0, 1.0)


RESULT = CellResult("cell 01", "open", "", ["ur5e", "ur5e"], 7, 4, [], cpu=1.0)


def test_a_blocked_cell_is_refused_and_the_search_agrees(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(real_cells, "free_faults", lambda cell: [])
    found = run_cell(real_cell(53), 30.0, compare=False)
    assert found.outcome == "infeasible"
    assert not found.answered
    assert found.search == NONE
    assert not found.contradicted
    assert found.reasons


def test_an_error_and_a_wrong_refusal_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def fails(cell: Cell, settings: Settings) -> None:
        calls.append(cell)
        raise ZeroDivisionError("somewhere")

    monkeypatch.setattr(real_cells, "optimize", fails)
    monkeypatch.setattr(real_cells, "free_faults", lambda cell: [])
    found = run_cell(real_cell(91), 30.0, compare=False)
    assert calls == [real_cell(91).cell]
    assert (found.outcome, found.search) == ("ERROR", FOUND)
    assert present(found.lattice) > 0.0
    monkeypatch.setattr(real_cells, "exhaustive", lambda cell, limit: TOO_LATE)
    assert run_cell(real_cell(91), 0.0, compare=False).search == KNOWN
    assert found.contradicted
    assert "somewhere" in found.reasons[0]
    assert "CONTRADICTED" in found.row()


def test_tables_count_what_matters() -> None:
    results = [
        replace(RESULT, objective=3.0, seconds=1.0, free=["x"], lattice=2.0),
        replace(RESULT, objective=3.0, seconds=2.0, faults=["arm_arm: too near"], free=[], lattice=10.0 / 3.0),
        replace(RESULT, outcome="infeasible", seconds=3.0, search=KNOWN, free=["x"]),
        replace(RESULT, name="cell 03", kind="blocked", outcome="infeasible", seconds=0.5, search=NONE),
        replace(RESULT, name="cell 07", kind="cluttered", outcome="infeasible", seconds=9.0, search=FOUND),
    ]
    summary = cell_tables.summary(results)
    assert "| open: a layout is known | 3 | 2 | 1 | 1 | 1 | 2.00 s | 2.80 s | 1.00 s, 1.00 s |" in summary
    assert "| blocked on purpose | 1 | 0 | 0 | 1 | 0 | 0.50 s | 0.50 s | 1.00 s, 1.00 s |" in summary
    assert "| all | 5 | 2 | 1 | 3 | 2 | 2.00 s | 6.60 s | 1.00 s, 1.00 s |" in summary
    remarks = cell_tables.remarks(results)
    assert "In 2 of 3 open cells" in remarks
    assert "2 answers could be compared" in remarks
    assert "1 are more than 1 % worse than it, the median is 1.20 times its E" in remarks
    assert "NOT CLEAN: arm_arm: too near" in remarks
    assert remarks.count("refused, but there is a layout") == 2
    beam = cell_tables.beam([BeamResult(True, 2.0, 59.7, []), BeamResult(False, 0.1, 58.9, ["arm_obstacle: hit"])])
    assert "| 30 mm asked for | 2.00 s | 59.7 | clean |" in beam
    assert "| without clearances | 0.10 s | 58.9 | arm_obstacle: hit |" in beam
    text = report.cells(results, [], 60.0, 60.0)
    assert summary in text


def test_a_section_is_replaced_and_the_others_stay_as_they_are() -> None:
    old = report.merged("", [report.section(title, f"old {title}", "make bench") for title in report.ORDER[1:]])
    new = report.merged(old, [report.section("Real cells", "new numbers\n\n### more", "make bench ARGS=cells")])
    assert new.startswith("# Benchmarks\n")
    assert "old Real cells" not in new
    assert "new numbers" in new
    assert "Made by `make bench ARGS=cells`" in new
    assert [line[3:] for line in new.splitlines() if line.startswith("## ")] == list(report.ORDER[1:])
    for title in report.ORDER[2:]:
        assert f"old {title}" in new
    assert report.merged(new, []) == new
    with pytest.raises(ValueError, match="no section"):
        report.section("Something", "", "")
