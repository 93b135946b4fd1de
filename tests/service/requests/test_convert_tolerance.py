"""Tolerances of poses: what they leave open, and what is refused, each with its field."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from duocell.models.base.pose import rotation_angle
from duocell.models.robot.freedom import Frame, Freedom
from duocell.optimizer.optimize import optimize
from duocell.optimizer.settings import Settings
from duocell.service.common.issues import InvalidRequest
from duocell.service.requests.convert import cell_of, joints_of
from duocell.service.results.documents import result_document
from duocell.service.schemas.evaluate import EvaluateRequest
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.settings import Limits
from duocell.service.validation import validate
from duocell.service.validation.range_limits import check_sizes

FREE = np.inf


def request(tolerance: Any) -> LayoutRequest:
    body = deepcopy(EXAMPLE)
    body["arms"][0]["tolerance"] = tolerance
    return validate(LayoutRequest, body)


def freedom(tolerance: Any) -> Freedom:
    found = cell_of(request(tolerance)).arms[0].freedom
    assert found is not None
    return found


def refused(tolerance: Any) -> dict[str, str]:
    def read() -> None:
        asked = request(tolerance)
        check_sizes(asked, Limits())
        cell_of(asked)

    with pytest.raises(InvalidRequest) as error:
        read()
    return {issue.pointer: issue.detail for issue in error.value.issues}


def test_without_a_tolerance_or_with_one_of_nothing_poses_are_given() -> None:
    nothing: list[Any] = [None, {"roll": {"range": [0.0, 0.0]}}, {"position": {"x": [0.0, 0.0]}}, {"position": {}}]
    for tolerance in nothing:
        assert cell_of(request(tolerance)).arms[0].freedom is None
    assert cell_of(request({"roll": {}})).arms[1].freedom is None


def test_ranges_become_parameters() -> None:
    box = freedom({"frame": "world", "position": {"x": [-0.01, 0.02]}, "rotation": {"x": [-0.1, 0.1], "z": "free"}})
    assert np.all(box.frames == Frame.WORLD)
    assert np.allclose(box.lower[0], [-0.01, 0, 0, 0, 0, -0.1, 0, -FREE])
    assert np.allclose(box.upper[0], [0.02, 0, 0, 0, 0, 0.1, 0, FREE])
    assert np.all(np.isinf(box.steps))
    turned = freedom({"cone": {"axis": [0, 2, 0], "angle": 0.3}, "roll": {"axis": [0, 1, 0], "range": [-0.2, 0.4]}})
    assert np.allclose(turned.cone, 0.3)
    assert np.allclose(turned.axes[0] @ [0, 0, 1], [0, 1, 0])
    assert float(np.linalg.det(turned.axes[0])) == pytest.approx(1.0)
    assert np.allclose(turned.upper[0], [0, 0, 0, 0.3, 0.3, 0, 0, 0.4])
    assert np.isinf(freedom({"roll": {"range": [-3.2, 3.2]}}).upper[0, -1])  # more than a turn is any


def test_steps_and_ranges_of_poses() -> None:
    limited = freedom({"roll": {}, "max_step": {"rotation": 0.2}})
    assert np.allclose(limited.steps[3:], 0.2)
    assert np.all(np.isinf(limited.steps[:3]))
    assert np.all(freedom({"roll": {}, "same_for_all": True}).steps == 0.0)
    some = freedom([{"roll": {}, "poses": [0, 3]}, {"position": {"z": [0.0, 0.1]}, "poses": [5, 9]}])
    assert np.isinf(some.upper[:4, -1]).all()
    assert np.all(some.upper[4:, -1] == 0.0)
    assert some.upper[:, 2].tolist() == [0.0] * 5 + [0.1] * 5


WRONG: list[tuple[Any, str, str]] = [
    ({}, "", "nothing is open"),
    ({"position": {"x": [0.1, -0.1]}}, "/position/x", "above"),
    ({"cone": {"angle": 3.5}}, "/cone/angle", "3.14159"),
    ({"cone": {"angle": 0.0}}, "/cone/angle", "greater"),
    ({"cone": {"angle": 0.2}, "rotation": {"x": [0, 0.1]}}, "/cone", "rotation is given too"),
    ({"roll": {}, "rotation": {"z": "free"}}, "/roll", "rotation is given too"),
    ({"cone": {"angle": 0.2}, "roll": {"axis": [1, 0, 0]}}, "/roll/axis", "different axes"),
    ({"roll": {"axis": [0, 0, 0]}}, "/roll/axis", "zero"),
    ({"roll": {"range": [0.0, 90.0]}}, "/roll/range", "radians"),
    ({"rotation": {"y": [-2.0, 0.0]}}, "/rotation/y", "π/2"),
    ({"roll": {}, "same_for_all": True, "max_step": {"rotation": 0.1}}, "/max_step", "same_for_all"),
    ({"roll": {}, "same_for_all": True, "poses": [0, 3]}, "/poses", "at all poses"),
    ({"roll": {}, "poses": [3, 2]}, "/poses", "no poses of the task"),
    ({"roll": {}, "poses": [3, 10]}, "/poses", "no poses of the task"),
    ([{"roll": {}, "poses": [0, 4]}, {"roll": {}, "poses": [4, 5]}], "/1/poses", "another tolerance"),
    ({"roll": {}, "frame": "base"}, "/frame", "tool"),
    ({"position": {"x": [-1e5, 1e5]}}, "/position/x/0", "workcell"),
    ({"rol": {}}, "/rol", "roll"),
]


@pytest.mark.parametrize(("tolerance", "pointer", "words"), WRONG, ids=lambda value: str(value)[:40])
def test_what_contradicts_itself_is_refused_with_its_field(tolerance: Any, pointer: str, words: str) -> None:
    issues = refused(tolerance)
    assert f"/arms/0/tolerance{pointer}" in issues
    assert words in issues[f"/arms/0/tolerance{pointer}"]


MANIPULABILITY, AVAILABILITY = ({"measure": name, "weight": 2.0} for name in ("manipulability", "joint_availability"))


@pytest.mark.parametrize("objective", [[MANIPULABILITY], [AVAILABILITY, MANIPULABILITY]], ids=["other", "sum"])
def test_what_is_open_is_chosen_for_joint_availability_alone(objective: list[Any]) -> None:
    body = request({"roll": {}}).model_dump(mode="json") | {"objective": objective}
    with pytest.raises(InvalidRequest) as error:
        cell_of(validate(LayoutRequest, body))
    assert [issue.pointer for issue in error.value.issues] == ["/objective"]
    detail = error.value.issues[0].detail
    assert "manipulability is asked for, but the poses of main leave something open" in detail
    assert "only be chosen for joint_availability alone. Leave the objective out, or the tolerance" in detail
    given = deepcopy(body)
    given["arms"][0]["tolerance"] = {"roll": {"range": [0.0, 0.0]}}  # of nothing
    assert cell_of(validate(LayoutRequest, given)).objective.measures[-1].name == "manipulability"


def test_joint_availability_may_be_asked_for_by_its_name_where_something_is_open() -> None:
    body = request({"roll": {}}).model_dump(mode="json") | {"objective": [AVAILABILITY]}
    cell = cell_of(validate(LayoutRequest, body))
    assert cell.arms[0].freedom is not None
    assert cell.objective.terms[0].weight == 2.0


def test_joints_are_not_checked_against_poses_that_are_open() -> None:
    body = deepcopy(EXAMPLE)
    for arm in body["arms"]:
        arm["base"] = {"x": 0.1, "y": 0.9, "z": 0.0, "yaw": 0.0}
    body["arms"][0] |= {"tolerance": {"roll": {}}, "joints": [[0.0] * 6] * 10}
    asked = validate(EvaluateRequest, body)
    with pytest.raises(InvalidRequest) as error:
        joints_of(asked, cell_of(asked))
    assert [issue.pointer for issue in error.value.issues] == ["/arms/0/joints"]


def test_the_example_tells_what_was_chosen() -> None:
    body = json.loads((Path(__file__).parents[3] / "examples" / "free_roll.json").read_text())
    cell = cell_of(validate(LayoutRequest, body))
    layout = optimize(cell, Settings(certificate=None))
    found = result_document(layout, "")["arms"][0]["displacement"]
    assert found["parameters"] == ["tilt_x", "tilt_y", "turn_z"]
    assert len(found["values"]) == len(found["tool"]) == len(cell.task)
    asked = cell.task.poses @ cell.arms[0].grasp
    for pose, wanted, values in zip(found["tool"], asked, found["values"], strict=True):
        assert np.allclose(pose["position"], wanted[:3, 3], atol=1e-9)
        x, y, z, w = pose["orientation"]["quaternion"]
        axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
        assert np.arccos(np.clip(axis @ wanted[:3, 2], -1, 1)) <= 0.1 + 1e-6
        assert max(map(abs, values[:2])) <= 0.1 + 1e-9
    steps = np.abs(np.diff(np.array(found["values"]), axis=0))
    assert np.max(steps) <= 0.3 + 1e-6
    exact = optimize(cell_of(validate(LayoutRequest, body | {"arms": [body["arms"][0] | {"tolerance": None}]})))
    assert exact.objective is not None
    assert layout.objective is not None
    assert layout.objective < exact.objective
    assert float(rotation_angle(asked[0, :3, :3].T @ asked[0, :3, :3])) < 1e-7


def test_a_tolerance_of_nothing_gives_the_answer_without_one() -> None:
    plain, nothing = (
        optimize(cell_of(request(one)), Settings(certificate=None)).objective
        for one in (None, {"roll": {"range": [0.0, 0.0]}, "cone": None})
    )
    assert plain is not None
    assert nothing == pytest.approx(plain, rel=1e-9)
