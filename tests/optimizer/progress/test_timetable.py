"""How far a solve is: never backwards, and never longer than the limits leave."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from duocell.models.cell.surroundings import Clearances, Surroundings
from duocell.optimizer.monitoring.events import Event, Stage
from duocell.optimizer.monitoring.watch import watching
from duocell.optimizer.progress.timetable import Timetable, timetable
from duocell.optimizer.settings import CertificateSettings, Settings, ToleranceSettings
from tests.support.given.acceptance import load

LINE, _ = load("line")


def test_shares_are_weighed_by_time_and_never_fall(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    table = Timetable([("search", 3.0), ("skipped", 1.0), ("proof", 4.0)], most=20.0)
    told: list[Event] = []
    with watching(told.append, lambda: False):
        table.stage("search")("searching", 0.0)
        now[0] += 1.5
        table.stage("search")("searching", 0.5)
        table.stage("proof")("proving", 0.0)
        now[0] += 100.0
        table.stage("search")("searching again", 0.0)
    stages = [event for event in told if isinstance(event, Stage)]
    assert [stage.done for stage in stages] == pytest.approx([0.0, 1.5 / 8.0, 0.5, 0.5])
    assert stages[0].remaining == pytest.approx(8.0)  # as expected
    assert stages[1].remaining == pytest.approx(6.5)  # as it goes
    assert stages[3].remaining == 0.0  # the limits are over


@pytest.mark.parametrize(
    "settings",
    [
        Settings(),
        Settings(certificate=None, alternatives=2),
        Settings(certificate=CertificateSettings(0.01, 5.0), explain=True, tolerance=ToleranceSettings()),
        Settings(baselines=("interior-penalty",)),
    ],
)
def test_every_cell_has_a_timetable(settings: Settings) -> None:
    tied = replace(LINE, surroundings=Surroundings(clearances=Clearances(0.03)))
    for cell in (LINE, tied):
        shares: list[float] = []

        def note(what: str, share: float, shares: list[float] = shares) -> None:
            shares.append(share)

        table = timetable(cell, settings, note)
        for name in ("arms", "together", "proof", "verify", "explain", "tolerance", "baselines"):
            table.stage(name)(name, 0.0)
            table.stage(name)(name, 1.0)
        assert shares == sorted(shares)
        assert shares[0] == 0.0
        assert shares[-1] == pytest.approx(1.0)
