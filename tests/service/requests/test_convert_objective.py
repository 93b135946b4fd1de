"""What a request says of its objective, from its fields to the result."""

import json
from typing import Any

import pytest

from duocell.models.objective.registry import MEASURES
from duocell.service.requests.accept import accept
from duocell.service.requests.prepared import read_accepted
from duocell.service.schemas.request import LayoutRequest
from duocell.service.settings import Limits
from duocell.service.workers.solving import solve_request
from tests.service.requests.test_convert import cell, refused

Document = dict[str, Any]
ASKED = [{"measure": "joint_availability", "weight": 2.0}, {"measure": "manipulability"}]


def test_joint_availability_is_what_nothing_said_means(example: Document) -> None:
    said = cell({**example, "objective": [{"measure": "joint_availability"}]})
    assert cell(example).objective == said.objective
    assert [(term.measure.name, term.weight) for term in said.objective.terms] == [("joint_availability", 1.0)]


@pytest.mark.parametrize(
    ("objective", "pointer", "words"),
    [
        ([], "/objective", ""),
        ([{"measure": "speed"}], "/objective/0/measure", "manipulability"),
        ([{"measure": "manipulability", "weight": 0.0}], "/objective/0/weight", ""),
        ([{"measure": "manipulability", "weight": -1.0}], "/objective/0/weight", ""),
        ([{"measure": "manipulability", "weight": 1e9}], "/objective/0/weight", ""),
        ([{"weight": 1.0}], "/objective/0/measure", ""),
        ([*ASKED, {"measure": "manipulability"}], "/objective/2/measure", "manipulability"),
        ("manipulability", "/objective", ""),
    ],
)
def test_others_are_refused_where_they_stand(example: Document, objective: Any, pointer: str, words: str) -> None:
    (issue,) = refused({**example, "objective": objective}).items()
    assert issue[0] == pointer
    assert words in issue[1]


def test_the_worker_minimises_what_was_asked_for_and_says_so(example: Document) -> None:
    example["arms"] = example["arms"][:1]
    accepted = accept(json.dumps({**example, "objective": ASKED, "certificate": "auto"}).encode(), Limits())
    request, given = read_accepted(LayoutRequest, accepted.prepared)
    assert [term.measure for term in given.objective.terms] == [MEASURES[term.measure] for term in request.objective]
    result = solve_request(accepted.prepared, accepted.request_hash, 60.0)
    assert result["outcome"] == "feasible"
    assert [(term["measure"], term["weight"]) for term in result["objective_terms"]] == [
        ("joint_availability", 2.0),
        ("manipulability", 1.0),
    ]
    total = sum(term["weight"] * term["cost"] for term in result["objective_terms"])
    assert result["objective"] == pytest.approx(total, rel=1e-9)
    assert result["certificate"]["lower_bound"] is None
