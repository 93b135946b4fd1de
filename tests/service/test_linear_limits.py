"""Limits between joints in requests and results."""

from __future__ import annotations

import copy
import io
import json
from math import degrees
from typing import Any

import pytest

from duocell.optimizer.optimize import optimize
from duocell.optimizer.settings import Settings
from duocell.service.cli.printing.tables import print_layout
from duocell.service.common.issues import InvalidRequest
from duocell.service.requests.accept import accept
from duocell.service.requests.convert import cell_of
from duocell.service.results.documents import result_document
from duocell.service.schemas.arm import MOST_LINEAR_LIMITS
from duocell.service.schemas.request import LayoutRequest
from duocell.service.settings import Limits
from duocell.service.validation import validate

Document = dict[str, Any]
ROW: Document = {"coefficients": [0, 1, 1, 0, 0, 0], "lower": -3.0, "upper": 1.0}


def limited(example: Document, *rows: Any) -> Document:
    """The example with limits between joints for its first arm."""
    request = copy.deepcopy(example)
    request["arms"][0]["linear_limits"] = list(rows)
    return request


def refused(document: Document) -> dict[str, str]:
    with pytest.raises(InvalidRequest) as caught:
        accept(json.dumps(document).encode(), Limits())
    return {issue.pointer: issue.detail for issue in caught.value.issues}


AT = "/arms/0/linear_limits"


@pytest.mark.parametrize(
    ("rows", "pointer", "words"),
    [
        ([ROW | {"coefficients": [0, 1, 1]}], f"{AT}/0/coefficients", "3 values, but puma560 has 6 joints"),
        ([ROW | {"coefficients": [0] * 7}], f"{AT}/0/coefficients", "7 values, but puma560 has 6 joints"),
        ([ROW | {"coefficients": []}], f"{AT}/0/coefficients", "at least 1"),
        ([ROW | {"coefficients": [0] * 6}], f"{AT}/0/coefficients", "Every coefficient is 0"),
        ([ROW | {"coefficients": [0, 1, 1e-9, 0, 0, 0]}], f"{AT}/0/coefficients", "between 0.01 and 100"),
        ([ROW | {"coefficients": [0, 1, None, 0, 0, 0]}], f"{AT}/0/coefficients/2", "must be a number"),
        ([ROW, ROW | {"lower": 1.5}], f"{AT}/1/lower", "is not 0.0001 rad below upper"),
        ([ROW | {"lower": 1.0}], f"{AT}/0/lower", "is not 0.0001 rad below upper"),
        ([ROW | {"upper": None}], f"{AT}/0/upper", "must be a number"),
        ([{"coefficients": ROW["coefficients"], "lower": 0.0}], f"{AT}/0/upper", "is missing"),
        ([ROW | {"upper": 180.0}], f"{AT}/0/upper", "would be 3.14159"),
        ([ROW | {"lower": 30.0, "upper": 40.0}], f"{AT}/0", "no posture keeps it"),
        ([ROW | {"joints": {"2": 1}}], f"{AT}/0/joints", "is not known here"),
        ([ROW] * (MOST_LINEAR_LIMITS + 1), AT, f"at most {MOST_LINEAR_LIMITS}"),
        ([{}], f"{AT}/0/coefficients", "is missing"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(example: Document, rows: list[Any], pointer: str, words: str) -> None:
    found = refused(limited(example, *rows))
    assert words in found[pointer]


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999"])
def test_what_is_no_number_is_refused(example: Document, number: str) -> None:
    body = json.dumps(limited(example, ROW | {"upper": 123.25})).replace("123.25", number)
    with pytest.raises(Exception, match=r"NaN|Infinity|finite|number"):
        accept(body.encode(), Limits())


def test_rows_of_a_request_become_those_of_its_arm(example: Document) -> None:
    names = ROW | {"name": "forearm"}, ROW | {"coefficients": [0, 0, 0, 0, -0.5, 1.0]}
    first, second = cell_of(validate(LayoutRequest, limited(example, *names))).arms
    assert second.linear_limits is None
    assert first.linear_limits is not None
    joints = first.robot.joint_names
    assert first.linear_limits.names == ("forearm", f"- 0.5 {joints[4]} + {joints[5]}")
    assert first.linear_limits.matrix.tolist() == [[0, 1, 1, 0, 0, 0], [0, 0, 0, 0, -0.5, 1]]
    assert cell_of(validate(LayoutRequest, limited(example))).arms[0].linear_limits is None


def test_a_result_tells_what_is_left_of_each(example: Document) -> None:
    cell = cell_of(validate(LayoutRequest, limited(example, ROW | {"name": "forearm", "upper": 2.2})))
    found = result_document(optimize(cell, Settings(certificate=None)), "")
    (margin,) = found["arms"][0]["linear_margins"]
    sums = [row[1] + row[2] for row in found["arms"][0]["joints"]]
    assert margin["name"] == "forearm"
    assert margin["margin"] == pytest.approx(min(min(sums) + 3.0, 2.2 - max(sums)), abs=1e-12)
    assert found["arms"][1]["linear_margins"] == []
    printed = io.StringIO()
    print_layout({"name": "", "result": found}, printed)
    assert f"forearm keeps {degrees(margin['margin']):.1f}° to its limits" in printed.getvalue()
