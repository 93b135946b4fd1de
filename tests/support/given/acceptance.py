"""The acceptance cases: requests with certified best-known values, kept beside the checkout."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_from_quaternion, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.robot.posture import ELBOW, SHOULDER, WRIST, Posture
from tests.support.given.arms import make_arm, region
from tests.support.given.fields import ArmFields

FOLDER = Path(__file__).resolve().parents[2] / "data" / "acceptance"
CASES = tuple(sorted(path.name.removesuffix(".request.json") for path in FOLDER.glob("*.request.json")))


@cache
def load(name: str) -> tuple[Cell, dict[str, Any]]:
    """The cell of a case, read here without the service, and what is expected of its answer."""
    request = json.loads((FOLDER / f"{name}.request.json").read_text(encoding="utf-8"))
    expected = json.loads((FOLDER / f"{name}.expected.json").read_text(encoding="utf-8"))
    task = Task(np.array([_pose(pose) for pose in request["task"]["poses"]]))
    arms = []
    for body in request["arms"]:
        words = body.get("posture") or {}
        tables = (("shoulder", SHOULDER), ("elbow", ELBOW), ("wrist", WRIST))
        given: ArmFields = {}
        if body.get("tool") is not None:
            given["tool"] = _pose(body["tool"])
        if body.get("grasp") is not None:
            given["grasp"] = _pose(body["grasp"])
        if body.get("reference") is not None:
            given["reference"] = np.array(body["reference"])
        if isinstance(body.get("weights"), list):
            given["weights"] = np.array(body["weights"])
        assert body.get("limits") is None
        assert isinstance(body.get("weights", "range"), list) or body.get("weights", "range") == "range"
        given["posture"] = Posture(*(table[words[key]] if words.get(key) else None for key, table in tables))
        arms.append(make_arm(body["robot"], body["name"], region(**body["base"]), **given))
    return Cell(task, tuple(arms), request.get("max_joint_step", np.pi / 2), name), expected


def _pose(body: dict[str, Any]) -> Floats:
    orientation = body["orientation"]
    assert set(orientation) == {"quaternion"}
    return transform(rotation_from_quaternion(orientation["quaternion"]), body["position"])
