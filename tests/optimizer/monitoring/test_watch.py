"""Following a solve, and stopping it wherever it is."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.optimizer.monitoring.events import Bounded, Event, Iterated, Screened, Stage, Started, Verified
from duocell.optimizer.monitoring.watch import (
    Cancelled,
    OutOfTime,
    check_stop,
    ending,
    stopped,
    tell,
    unheard,
    watched,
    watching,
)
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import CertificateSettings, Settings
from tests.support.given.tasks import possible
from tests.support.present import present

PROVE = Settings(certificate=CertificateSettings(gap=0.05, time_limit=5.0))


def cell(name: str = "puma560") -> Cell:
    return possible(name, np.random.default_rng(3), poses=4, step=0.12, half=(0.2, 0.2, 0.0, np.pi)).cell


def followed(what: Cell, settings: Settings | None = None) -> tuple[list[Event], Layout]:
    events: list[Event] = []
    with watching(events.append, lambda: False):
        layout = optimize(what, settings)
    return events, layout


def test_everything_is_told_in_order_and_agrees_with_the_answer() -> None:
    events, layout = followed(cell(), PROVE)
    kinds = [type(event) for event in events]
    assert kinds[:2] == [Stage, Screened]
    assert kinds.index(Started) < kinds.index(Bounded) < kinds.index(Verified)
    starts = [event for event in events if isinstance(event, Started)]
    assert [event.start for event in starts] == list(range(1, layout.search.starts + 1))
    assert min(event.objective for event in starts if event.objective is not None) == pytest.approx(layout.objective)
    assert sum(event.candidates for event in events if isinstance(event, Screened)) == layout.search.candidates
    bounds = [event for event in events if isinstance(event, Bounded)]
    assert np.all(np.diff([event.lower_bound for event in bounds]) >= 0.0)
    assert bounds[-1].lower_bound == pytest.approx(present(layout.certificate).lower_bound)
    assert bounds[-1].boxes == present(layout.certificate).boxes
    assert {event.what for event in events if isinstance(event, Stage)} == {
        f"searching {layout.placements[0].arm}",
        f"proving {layout.placements[0].arm}",
        "verifying",
    }


def test_every_iteration_of_ipopt_is_told() -> None:
    events, _ = followed(cell())
    since: list[Iterated] = []
    for event in events:
        if isinstance(event, Iterated):
            since.append(event)
        elif isinstance(event, Started):
            assert [told.iteration for told in since] == list(range(event.iterations + 1))
            assert since[-1].violation < 1e-7
            if event.objective is not None:
                assert since[-1].objective == pytest.approx(event.objective, rel=1e-9)
            since = []


def test_watching_changes_nothing() -> None:
    _, layout = followed(cell())
    alone = optimize(cell())
    assert layout.objective == alone.objective
    assert np.array_equal(layout.placements[0].joints, alone.placements[0].joints)


@pytest.mark.parametrize(
    ("name", "settings"), [("puma560", PROVE), ("puma560", Settings(alternatives=1)), ("iiwa14", None)]
)
def test_a_solve_can_be_stopped_wherever_it_is(name: str, settings: Settings | None) -> None:
    task = cell(name)
    asked = 0

    def count() -> bool:
        nonlocal asked
        asked += 1
        return False

    with watching(lambda event: None, count):
        before = optimize(task, settings)
    assert asked > 20
    for at in np.unique(np.linspace(1, asked, 8).astype(int)):
        left = int(at)

        def stop() -> bool:
            nonlocal left
            left -= 1
            return left <= 0

        with pytest.raises(Cancelled), watching(lambda event: None, stop):
            optimize(task, settings)
        assert left > -5  # it goes no further than to the next place where it is asked
    assert optimize(task, settings).objective == before.objective  # nothing that is kept between solves was harmed


def test_a_baseline_can_be_stopped() -> None:
    stages: list[Event] = []

    def stop() -> bool:
        return bool(stages) and isinstance(stages[-1], Stage) and stages[-1].what.startswith("baseline")

    with pytest.raises(Cancelled), watching(stages.append, stop):
        optimize(cell(), Settings(baselines=("exterior-penalty",)))


def test_only_the_watched_thread_and_block_are_watched() -> None:
    events: list[Event] = []
    elsewhere: list[bool] = []
    with watching(events.append, lambda: True):
        assert watched()
        assert stopped()
        thread = threading.Thread(target=lambda: elsewhere.append(watched() or stopped()))
        thread.start()
        thread.join()
        with watching(lambda event: None, lambda: False):
            assert not stopped()
        assert stopped()
    tell(Stage("nobody listens", 0.0))
    assert elsewhere == [False]
    assert not watched()
    assert not stopped()
    assert events == []


def test_what_is_done_unheard_is_not_told_and_can_be_stopped() -> None:
    told: list[Event] = []
    with watching(told.append, lambda: True):
        with unheard():
            tell(Stage("searching something else", 0.0))
            assert stopped()
        tell(Stage("verifying", 1.0))
    assert told == [Stage("verifying", 1.0)]
    with unheard():
        assert not watched()


def test_a_block_ends_where_its_time_is_over_whoever_watches() -> None:
    with ending(time.perf_counter() + 1e6):
        check_stop()
        with ending(time.perf_counter() - 1.0):
            assert stopped()
            with pytest.raises(OutOfTime):
                check_stop()
            with ending(time.perf_counter() + 1e6), pytest.raises(OutOfTime):  # the block around counts as well
                check_stop()
        assert not stopped()
    with watching(lambda event: None, lambda: True), ending(time.perf_counter() - 1.0):
        with pytest.raises(Cancelled) as caught:
            check_stop()
        assert not isinstance(caught.value, OutOfTime)
