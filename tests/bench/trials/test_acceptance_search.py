"""The requests that were once answered wrongly: those of which the right answer costs little."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bench.kept.kept_requests import FOLDER
from bench.trials.acceptance_search import REFUTED, case, names, wrong
from bench.trials.trial import ask

QUICK = (
    "between_11",
    "bolted_to_a_side_face",
    "miss_dwell_8 alone",
    "miss_feature_16 alone",
    "miss_feature_91 alone",
    "miss_single_297 alone",
    "miss_single_398 alone",
    "redundant_10",
    "redundant_15",
    "redundant_26",
    "redundant_29",
    "redundant_3",
    "redundant_41",
    "redundant_72",
    "self_iiwa7_50mm",
    "self_ur10e_16mm",
)
"""Each at most a second or so; ``python -m bench.trials.acceptance_search`` asks all of them."""


@pytest.mark.parametrize("name", QUICK)
def test_what_was_answered_wrongly_is_answered_rightly(name: str) -> None:
    one = case(name)
    answer = ask(one.cell, one.settings)
    if name.startswith("self_"):  # what time it takes does not decide here
        answer = replace(answer, cpu=0.0)
    assert wrong(one, answer) == ""


def test_every_file_is_a_case() -> None:
    assert {name.split()[0] for name in names()} == {file.stem for file in FOLDER.glob("*.json")}
    assert set(REFUTED) <= {name.split()[0] for name in names()}


def test_an_objective_above_what_is_known_is_wrong() -> None:
    one = case("redundant_72")
    answer = ask(one.cell, one.settings)
    assert one.known is not None
    assert "above" in wrong(one, replace(answer, objective=1.0011 * one.known))
    assert wrong(one, replace(answer, objective=1.0009 * one.known)) == ""
    assert "no layout" in wrong(one, replace(answer, objective=None))


def test_a_proof_is_wanted_where_no_base_can_help() -> None:
    one = case("self_ur10e_16mm")
    answer = ask(one.cell, one.settings)
    assert answer.layout is not None
    assert wrong(one, replace(answer, word="unknown")) == "called unknown"
    assert wrong(one, replace(answer, cpu=2.1)) == "late"
    assert wrong(one, replace(answer, layout=replace(answer.layout, reasons=()), cpu=0.0)) == "no largest distance"
