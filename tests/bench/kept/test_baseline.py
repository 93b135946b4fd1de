"""Kept answers: what counts as a difference, and a folder written and checked."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bench.kept.baseline import answered, cases, check, compared, differences, write
from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE

FOLDER = Path(__file__).parents[2] / "data" / "baseline"
QUICK = (
    "refused_*",
    "evaluation*",
    *("example_arc", "example_line", "example_line_certificate"),
    *("arm_thin_3", "arm_random_1", "arm_features_1", "redundant_iiwa14_path", "linear_limits*"),
    *("cell_07", "self_iiwa7_50mm", "impossible_far_apart", "impossible_no_room", "impossible_narrow_limits"),
)
"""All of them are asked by ``python -m bench.kept.baseline --check tests/data/baseline``."""
KEPT: dict[str, Any] = {
    "outcome": "feasible",
    "objective": 155.2,
    "proved": False,
    "arms": [{"name": "main", "base": {"position": [0.1, 0.2, 0.0]}, "objective": 70.0, "posture": None}],
    "reasons": [{"detail": "Too far: 0.3 m."}],
}


@pytest.mark.parametrize(
    ("change", "places"),
    [
        (lambda a: None, []),
        (lambda a: a.update(new="field"), []),
        (lambda a: a.update(objective=155.2 * (1.0 + 1e-10)), []),
        (lambda a: a.update(objective=155.2 * (1.0 + 1e-8)), ["/objective"]),
        (lambda a: a["arms"][0].update(objective=70.001), ["/arms/0/objective"]),
        (lambda a: a["arms"][0]["base"].update(position=[0.1, 0.2 + 1e-6, 0.0]), []),
        (lambda a: a["arms"][0]["base"].update(position=[0.1, 0.3, 0.0]), ["/arms/0/base/position/1"]),
        (lambda a: a.update(outcome="infeasible"), ["/outcome"]),
        (lambda a: a.update(proved=0), ["/proved"]),
        (lambda a: a.pop("proved"), ["/proved"]),
        (lambda a: a["reasons"][0].update(detail="Too far: 0.4 m."), ["/reasons/0/detail"]),
        (lambda a: a["reasons"].append({}), ["/reasons"]),
        (lambda a: a["arms"][0].update(posture={"elbow": "up"}), ["/arms/0/posture"]),
    ],
)
def test_what_is_a_difference(change: Callable[[Any], Any], places: list[str]) -> None:
    now = copy.deepcopy(KEPT)
    change(now)
    assert [one.split(":")[0].removesuffix(" is missing") for one in differences(KEPT, now)] == places


def test_written_answers_are_those_that_are_given_again(tmp_path: Path) -> None:
    for name, kind, body in (
        ("good", "evaluation", EVALUATE_EXAMPLE),
        ("bad", "layout", {**EVALUATE_EXAMPLE, "max_joint_step": -1.0}),
        ("no json", "layout", '{"name": '),
    ):
        (tmp_path / f"{name}.json").write_text(json.dumps({"kind": kind, "body": body}), encoding="utf-8")
    write(tmp_path, ["*"], lambda line: None)
    good, bad, no_json = (next(case.answer for case in cases(tmp_path, [name])) for name in ("good", "bad", "no json"))
    assert good["outcome"] == "feasible"
    assert "joints" not in good["arms"][0]
    assert (bad["status"], bad["errors"][0]["pointer"]) == (422, "/max_joint_step")
    assert (no_json["status"], no_json["code"]) == (400, "invalid-json")
    assert check(tmp_path, ["*"], lambda line: None) == 0
    file = tmp_path / "bad.json"
    file.write_text(file.read_text(encoding="utf-8").replace("greater than", "more than"), encoding="utf-8")
    assert check(tmp_path, ["*"], lambda line: None) == 1


def test_what_is_sent_is_the_body_itself(tmp_path: Path) -> None:
    (tmp_path / "one.json").write_text(json.dumps({"kind": "layout", "body": [1]}), encoding="utf-8")
    (case,) = cases(tmp_path)
    assert case.sent == b"[1]"
    assert answered(case, tmp_path)["errors"][0]["detail"].endswith(".")


@pytest.mark.parametrize("name", QUICK)
def test_what_is_quick_is_answered_as_it_was(name: str) -> None:
    asked = cases(FOLDER, [name])
    assert asked
    for case in asked:
        assert list(differences(compared(case.answer), answered(case, FOLDER))) == [], case.name


def test_no_kept_answer_hangs_on_time() -> None:
    every = cases(FOLDER)
    assert len(every) >= 60
    solved = [case for case in every if "outcome" in case.answer]
    assert all(case.answer["search"]["ended"] for case in solved)
    asked = [case.body for case in solved if case.kind == "layout"]
    assert all(body["certificate"] != "auto" and body["time_limit"] >= 600.0 for body in asked)
