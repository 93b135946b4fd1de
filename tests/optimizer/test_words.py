"""The four words: none of them is said without what it takes."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from bench.kept.kept_requests import kept
from duocell.models.cell.coupling import Distance
from duocell.models.cell.surroundings import Clearances, Surroundings
from duocell.models.geometry.shapes import Body, Box
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.coupled.layout import coupled_layout
from duocell.optimizer.coupled.prove import against
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Certificate, Layout, Outcome, Search
from duocell.optimizer.settings import CertificateSettings, Settings
from duocell.service.requests.accept import accept
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.settings import Settings as ServiceSettings
from tests.support.given.acceptance import load
from tests.support.given.arms import region
from tests.support.given.tasks import possible
from tests.support.oracles.answers import assert_ended

LINE, _ = load("line")


@pytest.mark.parametrize(
    ("usable", "proved", "word"),
    [(True, True, "optimal"), (True, False, "feasible"), (False, True, "infeasible"), (False, False, "unknown")],
)
def test_the_word_follows_from_layout_and_proof(usable: bool, proved: bool, word: str) -> None:
    outcome = Outcome.of(usable=usable, proved=proved)
    assert outcome == word
    assert (outcome.usable, outcome.proved) == (usable, proved)
    layout = Layout(outcome, None, (), (), Search(0, 0, 0, 0.0), None)
    assert (layout.usable, layout.proved) == (usable, proved)


def test_optimal_needs_a_proof_and_a_proof_needs_to_be_tried() -> None:
    proved = optimize(LINE)
    assert proved.outcome is Outcome.OPTIMAL
    assert proved.certificate is not None
    assert proved.certificate.gap is not None
    assert proved.certificate.gap <= 1e-3
    assert optimize(LINE, Settings(certificate=None)).outcome is Outcome.FEASIBLE
    few = optimize(LINE, Settings(certificate=CertificateSettings(1e-3, 60.0, boxes=400)))
    assert few.outcome is Outcome.FEASIBLE
    assert few.search.ended
    assert few.certificate is not None
    assert few.certificate.ended
    assert few.certificate.boxes <= 400
    assert few.objective == proved.objective


def test_an_arm_without_closed_form_is_feasible_and_told_why() -> None:
    layout = optimize(possible("iiwa14", np.random.default_rng(13), poses=3, half=(0.1, 0.1, 0.0, 0.3)).cell)
    assert layout.outcome is Outcome.FEASIBLE
    assert layout.certificate is not None
    assert layout.certificate.lower_bound is None
    assert layout.certificate.arms[0].note
    assert_ended(layout)


def test_infeasible_needs_a_proof_of_its_own() -> None:
    """A base two kilometres away; and a conditioning that nobody has, with no proof tried or allowed."""
    far = replace(LINE, arms=(replace(LINE.arms[0], base=region(2000.0, 0.0)), LINE.arms[1]))
    for certificate in ("auto", None):
        layout = optimize(far, Settings(certificate=certificate))
        assert layout.outcome is Outcome.INFEASIBLE
        assert layout.proved
        assert [placement.arm for placement in layout.placements] == ["follower"]


def test_nothing_found_and_nothing_proved_is_unknown() -> None:
    """Two seven-jointed arms whose bases may not be where both can work: no proof is offered for such arms."""
    task = possible("iiwa14", np.random.default_rng(13), poses=3, half=(0.1, 0.1, 0.0, 0.3))
    arms = (task.arm, replace(task.arm, name="other"))
    cell = replace(task.cell, arms=arms, couplings=(Distance((0, 1), 40.0, 41.0),))
    layout = optimize(cell, Settings(time_limit=60.0))
    assert layout.outcome in (Outcome.UNKNOWN, Outcome.INFEASIBLE)
    if layout.outcome is Outcome.UNKNOWN:
        assert {"not_found", "limit_reached"} & {reason.kind for reason in layout.reasons}
    assert layout.objective is None


@pytest.mark.parametrize("limit", [1e-6, 0.3])
def test_a_search_that_time_cuts_is_never_infeasible(limit: float) -> None:
    asked = kept("time_cut_called_infeasible")
    accepted = accept(json.dumps(asked["request"]).encode(), ServiceSettings())
    cell = cell_of(LayoutRequest.model_validate_json(accepted.text))
    layout = optimize(cell, Settings(time_limit=limit))
    assert layout.outcome is not Outcome.INFEASIBLE
    if layout.outcome is Outcome.UNKNOWN:
        assert not layout.search.ended
        assert "limit_reached" in {reason.kind for reason in layout.reasons}
        assert layout.search.first_feasible_time is None


def test_the_word_does_not_depend_on_how_fast_the_machine_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock stands still, or runs so that every look at it costs a tenth of a millisecond more."""
    settings = Settings(time_limit=1e6)
    said = []
    for tick in (0.0, 1e-7, 1e-4):
        ticks = count()
        with monkeypatch.context() as patched:
            patched.setattr(time, "perf_counter", lambda ticks=ticks, tick=tick: next(ticks) * tick)
            layout = optimize(LINE, settings)
        assert layout.certificate is not None
        said.append((layout.outcome, layout.objective, layout.certificate.lower_bound, layout.certificate.boxes))
    assert said[0] == said[1] == said[2]


CERTIFICATE = Certificate(90.0, 0.1, False, 5, 0.1, (), wanted=0.05)


@pytest.mark.parametrize(
    ("objective", "gap", "proved"),
    [(None, None, False), (100.0, 0.1, False), (94.0, 4.0 / 94.0, True), (89.0, 0.0, True)],
)
def test_a_certificate_is_held_against_the_answer_that_is_given(
    objective: float | None, gap: float | None, proved: bool
) -> None:
    found = against(CERTIFICATE, objective)
    assert found.gap == (None if gap is None else pytest.approx(gap))
    assert found.proved is proved


def test_a_layout_outweighs_a_proof_that_there_is_none() -> None:
    wrong = replace(CERTIFICATE, lower_bound=None, gap=None, proved=True, infeasible=True)
    assert against(wrong, None).proved
    found = against(wrong, 100.0)
    assert (found.proved, found.infeasible, found.gap) == (False, False, None)


@pytest.mark.parametrize(
    ("certificate", "proved", "word"),
    [
        (None, False, "unknown"),
        (None, True, "infeasible"),
        (CERTIFICATE, False, "unknown"),
        (replace(CERTIFICATE, lower_bound=None, gap=None, proved=True, infeasible=True), False, "infeasible"),
    ],
)
def test_a_coupled_search_without_a_layout(certificate: Certificate | None, proved: bool, word: str) -> None:
    far = Body("far", np.eye(4), Box(np.ones(3)))
    cell = replace(LINE, surroundings=Surroundings((far,), clearances=Clearances(0.01)))
    alone = Layout(Outcome.UNKNOWN, None, (), (), Search(0, 0, 0, 0.0), None, certificate=certificate)
    layout = coupled_layout(cell, alone, CoupledSearch(proved=proved), 0)
    assert layout.outcome == word
    assert layout.reasons
