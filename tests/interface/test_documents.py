"""Requests in, layouts evaluated, results out: the same as over the service."""

import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import duocell
from duocell.models.base.errors import InvalidInput
from duocell.service.cli.check import check
from duocell.service.cli.input import RobotUrdfs
from duocell.service.schemas.result import LayoutResult

LINE = Path(__file__).parents[2] / "examples" / "line.json"


@lru_cache
def request_() -> duocell.Request:
    return duocell.read_request(LINE)


@lru_cache
def layout() -> duocell.Layout:
    return duocell.optimize(request_().cell, replace(request_().settings, certificate=None))


def bases() -> dict[str, list[float]]:
    return {placement.arm: [*placement.position, placement.yaw] for placement in layout().placements}


@pytest.mark.parametrize(
    "source",
    [LINE, str(LINE), LINE.read_bytes(), LINE.read_text(), json.loads(LINE.read_text())],
    ids=["path", "name", "bytes", "text", "document"],
)
def test_a_request_is_read_from_whatever_holds_it(source: Any) -> None:
    read = duocell.read_request(source)
    np.testing.assert_array_equal(read.cell.task.poses, request_().cell.task.poses)
    assert read.settings == request_().settings
    assert read.settings.time_limit == 60.0


def test_a_request_says_how_it_wants_to_be_solved() -> None:
    asked = {**json.loads(LINE.read_text()), "time_limit": 7.0, "certificate": {"gap": 0.02, "time_limit": 3.0}}
    settings = duocell.read_request(asked).settings
    assert settings == duocell.Settings(time_limit=7.0, certificate=duocell.CertificateSettings(0.02, 3.0))


@pytest.mark.parametrize("source", [b"{", {"task": float("nan")}, {"task": np.eye(4)}, {}], ids=str)
def test_what_is_no_request_is_refused_in_one_way(source: Any) -> None:
    with pytest.raises(duocell.InvalidRequest) as refused:
        duocell.read_request(source)
    assert all(issue.detail for issue in refused.value.issues)
    assert isinstance(refused.value, duocell.DuocellError)
    assert refused.value.issues[0].detail in refused.value.detail


def test_everything_that_is_wrong_is_told() -> None:
    asked = json.loads(LINE.read_text())
    asked["arms"][0]["robot"], asked["arms"][1]["reference"] = "pumma", [0.0]
    with pytest.raises(duocell.InvalidRequest) as refused:
        duocell.read_request(asked)
    assert {issue.pointer for issue in refused.value.issues} == {"/arms/0/robot", "/arms/1/reference"}


def test_a_missing_file_is_what_python_says() -> None:
    with pytest.raises(FileNotFoundError):
        duocell.read_request("no/such/file.json")


def test_the_document_is_checked_by_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written = tmp_path / "line.result.json"
    written.write_text(json.dumps(request_().document(layout()), allow_nan=False))
    assert check(str(written), None, RobotUrdfs()) == 0
    assert "feasible, objective 155.20" in capsys.readouterr().out


def test_the_result_is_that_of_the_service_but_for_what_a_request_brings() -> None:
    alone, whole = duocell.result_document(layout()), request_().document(layout())["result"]
    LayoutResult.model_validate_json(json.dumps(alone, allow_nan=False))
    assert len(whole["request_hash"]) == 64
    assert [warning["pointer"] for warning in whole["warnings"]] == ["/arms/0/tool", "/arms/1/tool"]
    assert alone == {**whole, "request_hash": "", "warnings": []}


# --- evaluation -------------------------------------------------------------------------------------------------------


def test_a_layout_is_worth_what_was_found() -> None:
    for again in (duocell.evaluate(request_().cell, layout()), duocell.evaluate(request_().cell, bases())):
        assert again.outcome == "feasible"
        assert again.objective == pytest.approx(layout().objective, rel=1e-6)


def test_elsewhere_it_costs_more() -> None:
    x, y, z, yaw = bases()["main"]
    found, moved = layout(), duocell.evaluate(request_().cell, {**bases(), "main": (x + 0.05, y, z, yaw)})
    assert found.objective is not None
    assert moved.objective is not None
    assert moved.objective > found.objective  # which is at most 0.1 % from the best, see README.md


def test_joints_are_checked_as_they_are() -> None:
    joints = {placement.arm: placement.joints for placement in layout().placements}
    joints["main"] = joints["main"] + 0.01
    wrong = duocell.evaluate(request_().cell, layout(), joints)
    assert wrong.outcome == "infeasible"
    assert {reason.arm for reason in wrong.reasons} == {"main"}


WRONG: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    ({"main": [0.2, 0.9, 0.0, 0.0]}, {}, "follower is not fixed"),
    ({"third": [0.0, 0.0, 0.0, 0.0]}, {}, "no arm 'third'"),
    ({"main": [9.0, 0.9, 0.0, 0.0]}, {}, "main stands at x = 9 m"),
    ({"main": [0.2, 0.9, 0.1, 0.0]}, {}, "main stands at z = 0.1 m"),
    ({"main": [0.2, 0.9, 0.0]}, {}, "four numbers"),
    ({"main": [0.2, float("nan"), 0.0, 0.0]}, {}, "four numbers"),
    ({}, {"main": [[0.0] * 6]}, "10 rows"),
]


@pytest.mark.parametrize(("moved", "joints", "why"), WRONG, ids=lambda value: str(value)[:30])
def test_what_cannot_be_evaluated_is_refused(moved: dict[str, Any], joints: dict[str, Any], why: str) -> None:
    placed = {**bases(), **moved}
    if "follower is not" in why:
        del placed["follower"]
    with pytest.raises(InvalidInput, match=why):
        duocell.evaluate(request_().cell, placed, joints)


def test_a_yaw_outside_the_region_is_refused() -> None:
    cell = request_().cell
    region = replace(cell.arms[0].base, yaw=type(cell.arms[0].base.x)(0.0, 1.0))
    narrow = replace(cell, arms=(replace(cell.arms[0], base=region), cell.arms[1]))
    with pytest.raises(InvalidInput, match="turned by"):
        duocell.evaluate(narrow, bases())
