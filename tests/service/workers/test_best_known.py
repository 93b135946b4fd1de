"""What a solve that is ended leaves behind: the best layout so far, checked, or that nothing is known."""

import json
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.optimizer.monitoring.events import Event
from duocell.optimizer.monitoring.watch import Cancelled, watching
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.optimize import optimize
from duocell.optimizer.progress.interim import interim_layout
from duocell.optimizer.progress.known import Solved, Usable
from duocell.optimizer.results.layout import Outcome
from duocell.optimizer.settings import Settings, ToleranceSettings
from duocell.service.common.issues import Issue
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.workers.answer import Answer
from duocell.service.workers.best_known import BestKnown, KnownAnswer


class Told(list[Answer]):
    """Answers that were told."""

    def __call__(self, event: Event) -> None:
        assert isinstance(event, KnownAnswer)
        self.append(Answer(*json.loads(event.text)))


@pytest.fixture(scope="module")
def first() -> Usable:
    """The first layout that a solve tells of; it is ended then."""
    found: list[Usable] = []

    def see(event: Event) -> None:
        if isinstance(event, Usable):
            found.append(event)

    with pytest.raises(Cancelled), watching(see, lambda: bool(found)):
        optimize(made(), Settings(certificate=None))
    return found[0]


def made() -> Cell:
    from duocell.service.requests.convert import cell_of

    return cell_of(LayoutRequest.model_validate(EXAMPLE | {"certificate": None}), None)


def test_nothing_is_known_in_the_beginning() -> None:
    told = Told()
    BestKnown(told, "hash", 5.0).begin()
    (answer,) = told
    result = json.loads(answer.text or "")
    assert (answer.outcome, answer.ended_by) == ("unknown", "time-limit")
    assert result["request_hash"] == "hash"
    assert "5 s" in result["reasons"][0]["detail"]
    assert result["search"]["ended"] is False


def test_a_layout_that_was_found_is_an_answer_with_all_that_belongs_to_it(first: Usable) -> None:
    told = Told()
    BestKnown(told, "hash", 5.0)(first)
    (answer,) = told
    result = json.loads(answer.text or "")
    assert answer.outcome == "feasible"
    own = sum(objective_of(first.cell, arm, p.joints) for arm, p in zip(first.cell.arms, first.points, strict=True))
    assert answer.objective == pytest.approx(own, rel=1e-9)
    assert result["verification"]["limits_respected"] is True
    assert result["verification"]["max_position_error"] < 1e-6
    assert [arm["name"] for arm in result["arms"]] == [arm.name for arm in first.cell.arms]
    assert np.shape(result["arms"][0]["joints"]) == (10, 6)
    assert result["proved"] is False


def test_a_layout_that_fails_its_check_is_none(first: Usable) -> None:
    wrong = replace(first.points[0], joints=first.points[0].joints + 0.01)
    layout = interim_layout(first.cell, (wrong, *first.points[1:]), 0.1, 5.0, "ended")
    assert layout.outcome is Outcome.UNKNOWN
    assert layout.placements == ()


def test_dear_answers_come_seldom_and_the_last_one_is_not_lost(first: Usable) -> None:
    times = iter([0.0, 0.1, 0.1, 1.1, 2.0, 30.0, 30.0, 30.1, 50.0])
    told = Told()
    known = BestKnown(told, "hash", 5.0, clock=lambda: next(times))
    known(first)  # told, and takes a second
    known(first)  # at 2.0: too early
    assert len(told) == 1
    known.flush(0.2)  # too dear to be waited for
    assert len(told) == 1
    known(first)  # at 30.0
    assert len(told) == 2
    known.flush()  # nothing new
    assert len(told) == 2


def test_the_final_answer_of_the_search_takes_the_place_of_all_before(first: Usable) -> None:
    told = Told()
    known = BestKnown(told, "hash", 5.0)
    final = interim_layout(first.cell, first.points, 0.1, 0.2, "why")
    known(first)
    known(first)
    known(Solved(final))
    known.flush()
    assert json.loads(told[-1].text or "")["search"]["wall_time"] == 0.2


def test_an_answer_warns_and_names_what_is_missing(first: Usable) -> None:
    told = Told()
    known = BestKnown(told, "hash", 5.0)
    settings = Settings(alternatives=2, tolerance=ToleranceSettings(), baselines=("interior-penalty",))
    known.understood(settings, lambda layout: [Issue("/arms/0", f"{len(layout.placements)} placed")])
    known(first)
    results = [json.loads(answer.text or "") for answer in told]
    assert [result["warnings"][0]["detail"] for result in results] == ["0 placed", "2 placed"]
    for result, missing in zip(
        results, ("certificate, baselines", "certificate, alternatives, tolerance, baselines"), strict=True
    ):
        assert result["reasons"][0]["detail"].endswith(
            f"; not computed, and null or empty here: {missing}; allow more time"
        )
    final = interim_layout(first.cell, first.points, 0.1, 0.2, "why")
    known(Solved(replace(final, reasons=(), search=replace(final.search, ended=True))))
    (reason,) = json.loads(told[-1].text or "")["reasons"]
    assert reason["kind"] == "limit_reached"
    assert "certificate, tolerance, baselines" in reason["detail"]
