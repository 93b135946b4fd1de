"""An arm on a linear axis, from the request to tables and drawings."""

from __future__ import annotations

import io
import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.models.kinematics.kinematics import flange_poses
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings
from duocell.service.cli.printing.tables import print_layout
from duocell.service.common.issues import InvalidRequest
from duocell.service.figure.figure import write_figure
from duocell.service.library.user_robot import UserRobot, as_document, from_document
from duocell.service.requests.convert import cell_of
from duocell.service.requests.warnings import warnings_of
from duocell.service.results.documents import result_document
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate

REQUEST: dict[str, Any] = json.loads((Path(__file__).parents[2] / "examples" / "linear_axis.json").read_text())


def cell(**changes: Any) -> Cell:
    return cell_of(validate(LayoutRequest, REQUEST | changes))


def layout_of(made: Cell) -> Layout:
    return optimize(made, Settings(certificate=None))


def arms(**changes: Any) -> list[dict[str, Any]]:
    return [deepcopy(REQUEST["arms"][0]) | changes]


def pointer_of(**changes: Any) -> tuple[str, str]:
    """Place and words of the one thing that is wrong."""
    with pytest.raises(InvalidRequest) as caught:
        cell(**changes)
    [issue] = caught.value.issues
    return issue.pointer, issue.detail


def test_the_axis_lies_along_x_of_the_base() -> None:
    robot = cell().arms[0].robot
    q = np.zeros((2, 7))
    q[1, 0] = 0.8
    first, second = flange_poses(robot, q)
    assert second - first == pytest.approx(np.array([[0, 0, 0, 0.8], *3 * [4 * [0]]]), abs=1e-9)
    assert first[2, 3] == pytest.approx(0.25 + 0.1807 - 0.11985, abs=1e-6)


@pytest.mark.parametrize(
    ("steps", "turn", "shift"),
    [
        (1.2, 1.2, np.inf),
        ({"revolute": 0.6}, 0.6, np.inf),
        ({"prismatic": 0.4}, np.pi / 2, 0.4),
        ({"revolute": 0.6, "prismatic": None}, 0.6, np.inf),
    ],
)
def test_steps_by_kind_of_joint(steps: Any, turn: float, shift: float) -> None:
    made = cell(max_joint_step=steps)
    assert (made.max_joint_step, made.max_prismatic_step) == (turn, shift)
    limits = made.step_limits(made.arms[0].robot)
    assert limits.tolist() == [shift, *6 * [turn]]


@pytest.mark.parametrize(
    ("steps", "pointer"),
    [
        (0.0, "/max_joint_step"),
        (4.0, "/max_joint_step"),
        ("wide", "/max_joint_step"),
        ({"prismatic": -0.1}, "/max_joint_step/prismatic"),
        ({"revolute": 4.0}, "/max_joint_step/revolute"),
        ({"sliding": 0.1}, "/max_joint_step/sliding"),
    ],
)
def test_wrong_steps_are_named(steps: Any, pointer: str) -> None:
    assert pointer_of(max_joint_step=steps)[0] == pointer


def test_a_sum_of_lengths_and_angles_is_refused() -> None:
    row = {"coefficients": [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], "lower": -1.0, "upper": 1.0}
    pointer, detail = pointer_of(arms=arms(linear_limits=[row]))
    assert pointer == "/arms/0/linear_limits/0/coefficients/0"
    assert "no unit" in detail
    angles = row | {"coefficients": [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]}
    assert cell(arms=arms(linear_limits=[angles])).arms[0].linear_limits is not None


def test_faults_are_told_in_metres() -> None:
    reference = [3.0, *REQUEST["arms"][0]["reference"][1:]]
    pointer, detail = pointer_of(arms=arms(reference=reference))
    assert pointer == "/arms/0/reference/0"
    assert "3 m of joint" in detail
    rows = deepcopy(REQUEST["arms"][0]["robot"])
    rows["dh"][2]["type"] = "prismatic"
    pointer, detail = pointer_of(arms=arms(robot=rows))
    assert pointer == "/arms/0/robot/dh/2/type"
    assert "first joint" in detail


def test_metres_are_not_warned_of_as_degrees() -> None:
    limits = [[0.0, 12.0], *[[-3.0, 3.0]] * 6]
    reference = [11.0, 0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
    changes = {"arms": arms(limits=limits, reference=reference)}
    request = validate(LayoutRequest, REQUEST | changes)
    made = cell_of(request)
    found = warnings_of(request, made, layout_of(made))
    assert not [one for one in found if "rad" in one.detail]


def test_result_table_and_drawing(tmp_path: Path) -> None:
    made = cell()
    layout = layout_of(made)
    result = result_document(layout, "hash")
    [arm] = result["arms"]
    assert arm["joint_units"] == ["m", *6 * ["rad"]]
    joints = np.array(arm["joints"])
    assert arm["joint_margins"][0] == pytest.approx(2.0 - np.max(np.abs(joints[:, 0])), abs=1e-9)
    assert arm["minimum_margin"] == pytest.approx(min(arm["joint_margins"][1:]))
    check = result["verification"]
    assert check["max_prismatic_step"] == pytest.approx(np.max(np.abs(np.diff(joints[:, 0]))), abs=1e-12)
    assert check["max_prismatic_step"] <= 0.5
    assert check["max_joint_step"] == pytest.approx(np.max(np.abs(np.diff(joints[:, 1:], axis=0))), abs=1e-12)
    resource = {"name": "axis", "result": result, "request": REQUEST}
    text = io.StringIO()
    print_layout(resource, text)
    millimetres = f"{1e3 * arm['joint_margins'][0]:.1f} mm"
    assert millimetres in text.getvalue()
    assert f"{1e3 * check['max_prismatic_step']:.1f} mm of a linear axis" in text.getvalue()
    write_figure(resource, tmp_path / "axis.svg")
    assert (tmp_path / "axis.svg").stat().st_size > 10_000


def test_kept_robots_keep_their_kinds() -> None:
    robot = cell().arms[0].robot
    again = from_document(json.loads(json.dumps(as_document(UserRobot(robot, None, "1"))))).robot
    assert again.joint_kinds == robot.joint_kinds
    assert again.kinematic_key == robot.kinematic_key
