"""Malformed and absurd requests: every one gets advice, never a 500 and never a hang. Real workers stand behind."""

import copy
import json
import time
from collections.abc import Callable
from math import pi
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE
from duocell.service.schemas.request import EXAMPLE

Document = dict[str, Any]
Spoil = Callable[[Document], Any]

POSE = {"position": [0.8, 0.4, 0.1], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}
ROW = {"alpha": -pi / 2, "a": 0.1, "d": 0.2, "lower": -2.0, "upper": 2.0}


def put(path: str, value: Any) -> Spoil:
    """Replaces what a JSON pointer points to; a list index at its end is appended."""

    def spoil(request: Document) -> None:
        *way, last = path.strip("/").split("/")
        target: Any = request
        for part in way:
            target = target[int(part)] if isinstance(target, list) else target[part]
        if isinstance(target, list):
            target[int(last) :] = [value, *target[int(last) + 1 :]]
        else:
            target[last] = value

    return spoil


def drop(path: str) -> Spoil:
    """Removes a field."""

    def spoil(request: Document) -> None:
        *way, last = path.strip("/").split("/")
        target: Any = request
        for part in way:
            target = target[int(part)] if isinstance(target, list) else target[part]
        del target[last]

    return spoil


def task(value: Any) -> Spoil:
    return put("/task", value)


def turned(orientation: Any) -> Spoil:
    return put("/arms/0/grasp/orientation", orientation)


BOX = {"type": "box", "size": [1.0, 1.0, 1.0]}
CROSSED = [[0, 0], [1, 1], [1, 0], [0, 1]]


def obstacle(**fields: Any) -> Spoil:
    return put("/obstacles", [{"name": "table", "shape": BOX, **fields}])


def shape(**fields: Any) -> Spoil:
    return obstacle(shape=fields)


def tied(**fields: Any) -> Spoil:
    return put("/coupling", [{"arms": ["main", "follower"], **fields}])


REFUSED: dict[str, tuple[Spoil, str, str]] = {
    # name: how to spoil a good request, the pointer that must be named, a word of the advice
    "degrees in an orientation": (turned({"rpy": [180.0, 0.0, 0.0]}), "/arms/0/grasp/orientation/rpy", "3.14159"),
    "degrees in a pose": (
        task({"poses": [POSE, POSE | {"orientation": {"oat": [0.0, 90.0, 0.0]}}]}),
        "/task/poses/1/orientation/oat",
        "1.5708",
    ),
    "degrees of yaw": (put("/arms/1/base/yaw", [-30.0, 30.0]), "/arms/1/base/yaw", "radians"),
    "no task": (drop("/task"), "/task", "missing"),
    "no arms": (drop("/arms"), "/arms", "missing"),
    "empty list of arms": (put("/arms", []), "/arms", "at least 1"),
    "arms no list": (put("/arms", {}), "/arms", "list"),
    "an arm that is null": (put("/arms/0", None), "/arms/0", "object"),
    "nine arms": (put("/arms", [EXAMPLE["arms"][0]] * 9), "/arms", "8"),
    "no grasp": (drop("/arms/0/grasp"), "/arms/0/grasp", "missing"),
    "unknown field": (put("/arms/0/refrence", [0.0]), "/arms/0/refrence", "'reference'"),
    "unknown field at the top": (put("/colour", "red"), "/colour", "allowed are"),
    "boolean for a number": (put("/arms/0/base/z", True), "/arms/0/base/z", "boolean true"),
    "boolean in a vector": (put("/arms/0/grasp/position/1", False), "/arms/0/grasp/position/1", "number"),
    "string for a number": (put("/arms/0/base/x", "0.5"), "/arms/0/base/x", "without quotes"),
    "number too large": (put("/arms/0/base/x", 1e400), "/arms/0/base/x", "finite"),
    "whole number too large": (put("/arms/0/base/x", 10**400), "/arms/0/base/x", "too large"),
    "number for a string": (put("/arms/0/name", 7), "/arms/0/name", "quotes"),
    "empty name": (put("/arms/0/name", ""), "/arms/0/name", "at least 1"),
    "name with a line break": (put("/arms/0/name", "a\nb"), "/arms/0/name", "control"),
    "endless name": (put("/name", "x" * 10_000), "/name", "200"),
    "same name twice": (put("/arms/1/name", "main"), "/arms/1/name", "unique"),
    "unknown robot": (put("/arms/0/robot", "ur10x"), "/arms/0/robot", "ur10"),
    "robot null": (put("/arms/0/robot", None), "/arms/0/robot", "string"),
    "robot with two descriptions": (put("/arms/0/robot", {"dh": [ROW], "urdf": "x"}), "/arms/0/robot/urdf", "dh"),
    "table of one joint": (put("/arms/0/robot", {"dh": [ROW]}), "/arms/0/robot/dh", "6 or 7"),
    "table with all axes parallel": (
        put("/arms/0/robot", {"dh": [{**ROW, "alpha": 0.0}] * 6}),
        "/arms/0/robot/dh",
        "singular",
    ),
    "table with limits in disorder": (
        put("/arms/0/robot", {"dh": [{**ROW, "lower": 2.0, "upper": -2.0}] * 6}),
        "/arms/0/robot/dh/0/lower",
        "swap",
    ),
    "table in millimetres": (put("/arms/0/robot", {"dh": [{**ROW, "a": 431.8}] * 6}), "/arms/0/robot/dh/0/a", "metres"),
    "position with two numbers": (put("/arms/0/grasp/position", [0.0, 0.0]), "/arms/0/grasp/position", "at least 3"),
    "position with four numbers": (put("/arms/0/grasp/position", [0.0] * 4), "/arms/0/grasp/position", "at most 3"),
    "no orientation": (drop("/arms/0/grasp/orientation"), "/arms/0/grasp/orientation", "missing"),
    "empty orientation": (turned({}), "/arms/0/grasp/orientation", "exactly one of"),
    "two orientations": (
        turned({"rpy": [0, 0, 0], "quaternion": [0, 0, 0, 1]}),
        "/arms/0/grasp/orientation",
        "exactly one of",
    ),
    "orientation as a list": (turned([0, 0, 0, 1]), "/arms/0/grasp/orientation", "object"),
    "zero quaternion": (turned({"quaternion": [0, 0, 0, 0]}), "/arms/0/grasp/orientation/quaternion", "[0, 0, 0, 1]"),
    "quaternion too long": (turned({"quaternion": [0, 0, 0, 2]}), "/arms/0/grasp/orientation/quaternion", "Normalise"),
    "left-handed matrix": (
        turned({"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}),
        "/arms/0/grasp/orientation/matrix",
        "left-handed",
    ),
    "skewed matrix": (
        turned({"matrix": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}),
        "/arms/0/grasp/orientation/matrix",
        "orthonormal",
    ),
    "matrix of two rows": (
        turned({"matrix": [[1, 0, 0], [0, 1, 0]]}),
        "/arms/0/grasp/orientation/matrix",
        "at least 3",
    ),
    "empty task": (task({}), "/task", "exactly one of"),
    "task null": (task(None), "/task", "missing"),
    "task and tasks": (put("/tasks", [{"name": "a", "task": EXAMPLE["task"]}]), "/task", "exactly one of"),
    "two tasks": (task({"poses": [POSE, POSE], "line": EXAMPLE["task"]["line"]}), "/task", "exactly one of"),
    "no poses": (task({"poses": []}), "/task/poses", "at least 2"),
    "one pose": (task({"poses": [POSE]}), "/task/poses", "repeat"),
    "100,000 poses": (task({"poses": [0] * 100_000}), "/task/poses", "5000"),
    "a line of 100,000 poses": (put("/task/line/count", 100_000), "/task/line/count", "5000"),
    "a line of one pose": (put("/task/line/count", 1), "/task/line/count", "at least 2"),
    "a line of 2.5 poses": (put("/task/line/count", 2.5), "/task/line/count", "whole number"),
    "a line without end": (drop("/task/line/end"), "/task/line/end", "missing"),
    "a line that turns by 180°": (
        put("/task/line/end/orientation", {"rpy": [0.0, 0.0, pi - 0.785398]}),
        "/task/line/end/orientation",
        "180",
    ),
    "an arc without centre or radius": (
        task({"arc": {"start": POSE, "end": POSE, "count": 3}}),
        "/task/arc",
        "exactly one of",
    ),
    "an arc about a wrong centre": (
        task({"arc": {"start": POSE, "end": {**POSE, "position": [0, 0, 0.1]}, "center": [0, 0, 0], "count": 3}}),
        "/task/arc/center",
        "centre",
    ),
    "a pose farther than any cell": (put("/task/line/end/position/0", 1e6), "/task/line/end/position/0", "metres"),
    "base interval in disorder": (put("/arms/0/base/x", [1.0, -1.0]), "/arms/0/base/x", "Swap"),
    "yaw interval in disorder": (put("/arms/0/base/yaw", [3.0, -3.0]), "/arms/0/base/yaw", "2π"),
    "base interval of three": (put("/arms/0/base/x", [0.0, 1.0, 2.0]), "/arms/0/base/x", "at most 2"),
    "no yaw": (drop("/arms/0/base/yaw"), "/arms/0/base/yaw", "missing"),
    "yaw in thousands": (put("/arms/0/base/yaw", [-1e5, 1e5]), "/arms/0/base/yaw/0", "radians"),
    "reference of seven": (put("/arms/0/reference", [0.0] * 7), "/arms/0/reference", "6 joints"),
    "reference outside limits": (
        put("/arms/0/reference", [0.0, 0.0, 0.0, 0.0, 2.0, 0.0]),
        "/arms/0/reference/4",
        "joint_5",
    ),
    "weights of five": (put("/arms/0/weights", [1.0] * 5), "/arms/0/weights", "6 joints"),
    "negative weight": (put("/arms/0/weights", [1.0, 1.0, -1.0, 1.0, 1.0, 1.0]), "/arms/0/weights/2", "at least 0"),
    "unknown weights": (put("/arms/0/weights", "heavy"), "/arms/0/weights", "'range' or 'equal'"),
    "posture with an unknown word": (put("/arms/0/posture", {"elbow": "left"}), "/arms/0/posture/elbow", "'up'"),
    "posture of an arm without names": (
        lambda request: request["arms"][0].update(robot="iiwa14", posture={"elbow": "up"}, reference=None),
        "/arms/0/posture",
        "null",
    ),
    "limits of five": (put("/arms/0/limits", [[-1.0, 1.0]] * 5), "/arms/0/limits", "6 joints"),
    "limits in disorder": (put("/arms/0/limits", [[1.0, -1.0]] * 6), "/arms/0/limits/0", "Swap"),
    "limits without range": (put("/arms/0/limits", [[0.0, 0.0]] * 6), "/arms/0/limits/0", "Widen"),
    "limits in degrees": (put("/arms/0/limits", [[-160.0, 160.0]] * 6), "/arms/0/limits/0/0", "radians"),
    "joint step of zero": (put("/max_joint_step", 0.0), "/max_joint_step", "greater than 0"),
    "joint step beyond π": (put("/max_joint_step", 6.0), "/max_joint_step", "at most 3.14"),
    "conditioning beyond one": (put("/arms/0/min_conditioning", 1.5), "/arms/0/min_conditioning", "at most 1"),
    "gap of zero": (put("/certificate", {"gap": 0.0}), "/certificate/gap", "greater than 0"),
    "a day of proving": (put("/certificate", {"time_limit": 86400.0}), "/certificate/time_limit", "600"),
    "a baseline twice": (put("/baselines", ["exterior-penalty"] * 2), "/baselines/1", "twice"),
    "obstacles null": (put("/obstacles", None), "/obstacles", "list"),
    "an obstacle without a name": (put("/obstacles", [{"shape": BOX}]), "/obstacles/0/name", "missing"),
    "an obstacle without a shape": (put("/obstacles", [{"name": "a"}]), "/obstacles/0/shape", "missing"),
    "two obstacles of one name": (
        put("/obstacles", [{"name": "a", "shape": BOX}] * 2),
        "/obstacles/1/name",
        "unique",
    ),
    "two hundred and one obstacles": (put("/obstacles", [0] * 201), "/obstacles", "DUOCELL_MAX_OBSTACLES"),
    "an obstacle a thousand miles away": (
        obstacle(pose={**POSE, "position": [1e6, 0, 0]}),
        "/obstacles/0/pose/position",
        "metres",
    ),
    "an obstacle turned wrongly": (
        obstacle(pose={**POSE, "orientation": {"quaternion": [0, 0, 0, 2]}}),
        "/obstacles/0/pose/orientation/quaternion",
        "Normalise",
    ),
    "a shape without a type": (shape(size=[1, 1, 1]), "/obstacles/0/shape/type", "capsule"),
    "an unknown type of shape": (shape(type="cilinder"), "/obstacles/0/shape/type", "'cylinder'"),
    "a type of shape that is no word": (shape(type=["box"]), "/obstacles/0/shape/type", "half_space"),
    "a shape as a word": (obstacle(shape="box"), "/obstacles/0/shape", "braces"),
    "a box without a size": (shape(type="box"), "/obstacles/0/shape/size", "missing"),
    "a box with a radius": (shape(type="box", size=[1, 1, 1], radius=1), "/obstacles/0/shape/radius", "size"),
    "a flat box": (shape(type="box", size=[1, 1, 0]), "/obstacles/0/shape/size/2", "greater than 0"),
    "a box in millimetres": (shape(type="box", size=[1, 1200, 1]), "/obstacles/0/shape/size/1", "metres"),
    "a ball inside out": (shape(type="sphere", radius=-1), "/obstacles/0/shape/radius", "greater than 0"),
    "a mesh that nobody sent": (shape(type="mesh", id="none"), "/obstacles/0/shape/id", "'none'"),
    "a mesh of no size": (shape(type="mesh", id="none", scale=0.0), "/obstacles/0/shape/scale", "greater than 0"),
    "a part without shapes": (put("/part", {"shapes": []}), "/part/shapes", "at least 1"),
    "a part that is a half-space": (
        put("/part", {"shapes": [{"shape": {"type": "half_space"}}]}),
        "/part/shapes/0/shape/type",
        "box",
    ),
    "a grasp zone of less than nothing": (
        put("/part", {"shapes": [{"shape": BOX}], "grasp_zone": -0.1}),
        "/part/grasp_zone",
        "at least 0",
    ),
    "a tool that is a half-space": (
        put("/arms/1/tool_shapes", [{"shape": {"type": "half_space"}}]),
        "/arms/1/tool_shapes/0/shape/type",
        "box",
    ),
    "a tool of a hundred shapes": (put("/arms/1/tool_shapes", [0] * 100), "/arms/1/tool_shapes", "50"),
    "a floor that crosses itself": (put("/floor", {"allowed": CROSSED}), "/floor/allowed", "order"),
    "a forbidden line": (put("/floor", {"forbidden": [[[0, 0], [1, 1], [2, 2]]]}), "/floor/forbidden/0", "simple"),
    "a floor of two corners": (put("/floor", {"allowed": [[0, 0], [1, 1]]}), "/floor/allowed", "at least 3"),
    "a floor of too many corners": (put("/floor", {"forbidden": [[[0, 0]] * 101]}), "/floor/forbidden/0", "coarser"),
    "a floor as large as a country": (
        put("/floor", {"allowed": [[0, 0], [1e6, 0], [0, 1]]}),
        "/floor/allowed/1/0",
        "metres",
    ),
    "a floor with a negative margin": (put("/floor", {"margin": -1}), "/floor/margin", "at least 0"),
    "a pedestal without height": (
        put("/arms/0/pedestal", {"height": 0.0, "footprint": {"radius": 1}}),
        "/arms/0/pedestal/height",
        "greater than 0",
    ),
    "a pedestal in millimetres": (
        put("/arms/0/pedestal", {"height": 1500.0, "footprint": {"radius": 1}}),
        "/arms/0/pedestal/height",
        "1500",
    ),
    "a footprint without a form": (put("/arms/0/footprint", {}), "/arms/0/footprint", "exactly one of"),
    "a footprint of two forms": (
        put("/arms/0/footprint", {"radius": 1, "size": [1, 1]}),
        "/arms/0/footprint",
        "exactly one of",
    ),
    "a footprint with a dent": (
        put("/arms/0/footprint", {"polygon": [[0, 0], [1, 0], [0.2, 0.2], [0, 1]]}),
        "/arms/0/footprint/polygon",
        "convex",
    ),
    "a mount in degrees": (put("/arms/0/mount", {"roll": 180.0}), "/arms/0/mount/roll", "radians"),
    "a mount with a yaw": (put("/arms/0/mount", {"yaw": 1.0}), "/arms/0/mount/yaw", "pitch"),
    "a coupling without a type": (tied(), "/coupling/0/type", "mirror"),
    "an unknown coupling": (tied(type="same-z"), "/coupling/0/type", "'same_z'"),
    "a coupling of one arm": (tied(type="same_z", arms=["main"]), "/coupling/0/arms", "at least 2"),
    "a coupling of three arms": (tied(type="mirror", arms=["main"] * 3), "/coupling/0/arms", "at most 2"),
    "a coupling of an arm with itself": (
        tied(type="distance", arms=["main", "main"]),
        "/coupling/0/arms",
        "different",
    ),
    "a coupling of an unknown arm": (
        tied(type="same_z", arms=["main", "folower"]),
        "/coupling/0/arms/1",
        "'follower'",
    ),
    "a rail of one arm that leads nowhere": (tied(type="rail", arms=["main"], angle=0.0), "/coupling/0/arms", "2"),
    "a distance that nothing has": (tied(type="distance", minimum=2, maximum=1), "/coupling/0/minimum", "<="),
    "a direction in degrees": (tied(type="direction", angle=90.0), "/coupling/0/angle", "radians"),
    "a mirror without a point": (tied(type="mirror", angle=0.0), "/coupling/0/point", "missing"),
    "a negative clearance": (put("/clearance", {"arm_arm": -0.03}), "/clearance/arm_arm", "at least 0"),
    "an unknown class of pairs": (put("/clearance", {"arm_floor": 0.03}), "/clearance/arm_floor", "arm_obstacle"),
    "a clearance as a number": (put("/clearance", 0.03), "/clearance", "object"),
    "half an alternative": (put("/alternatives", 0.5), "/alternatives", "whole"),
    "eleven alternatives": (put("/alternatives", 11), "/alternatives", "at most 10"),
    "tolerances of nothing": (put("/tolerance", {"position": 0, "angle": 0}), "/tolerance", "positive"),
    "a tolerance of a metre": (put("/tolerance", {"position": 1.0}), "/tolerance/position", "at most 0.5"),
    "explain as a word": (put("/explain", "yes"), "/explain", "true or false"),
    "unknown baseline": (put("/baselines", ["guessing"]), "/baselines/0", "interior-penalty"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_place_and_advice(live: TestClient, name: str) -> None:
    spoil, pointer, word = REFUSED[name]
    request = copy.deepcopy(EXAMPLE)
    spoil(request)
    body = json.dumps(request).replace("Infinity", "1e400")
    began = time.monotonic()
    answer = live.post("/v1/layouts", content=body, headers={"Content-Type": "application/json"})
    assert time.monotonic() - began < 5.0
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["status"] == 422
    details = [error["detail"] for error in problem["errors"] if error["pointer"] == pointer]
    assert details, problem["errors"]
    assert any(word in detail for detail in details), details
    assert all(detail.endswith((".", "?")) for detail in details)


EVALUATED: dict[str, tuple[Spoil, str, str]] = {
    "a base that is not fixed": (put("/arms/0/base/x", [0.0, 1.0]), "/arms/0/base/x", "number"),
    "joints of five": (put("/arms/0/joints", [[0.0] * 5] * 10), "/arms/0/joints/0", "6 joints"),
    "joints of nine poses": (put("/arms/0/joints", [[0.0] * 6] * 9), "/arms/0/joints", "10 poses"),
    "joints in words": (put("/arms/0/joints", ["home"] * 10), "/arms/0/joints/0", "list"),
    "a joint that is not a number": (put("/arms/0/joints", [[None] * 6] * 10), "/arms/0/joints/0/0", "number"),
}


@pytest.mark.parametrize("name", EVALUATED)
def test_an_evaluation_is_refused_with_place_and_advice(live: TestClient, name: str) -> None:
    spoil, pointer, word = EVALUATED[name]
    request = copy.deepcopy(EVALUATE_EXAMPLE)
    spoil(request)
    answer = live.post("/v1/layouts/evaluate", json=request)
    assert answer.status_code == 422, answer.text
    details = [error["detail"] for error in answer.json()["errors"] if error["pointer"] == pointer]
    assert any(word in detail for detail in details), answer.json()["errors"]


@pytest.mark.parametrize(
    ("body", "word"),
    [
        (b"", "empty"),
        (b"{", "line 1"),
        (b'{"name": "a",\n "task": }', "line 2"),
        (b'{"max_joint_step": NaN}', "NaN"),
        (b'{"max_joint_step": -Infinity}', "Infinity"),
        (b'{"name": "a", "name": "b"}', "more than once"),
        (b'{"name": "\\ud800"}', "half a character"),
        (b'{"name": "\xff"}', "UTF-8"),
        (b"[" * 100_000, "nested"),
        (b'{"name": ' + b"9" * 5000 + b"}", "number"),
    ],
    ids=lambda value: value[:20].decode("latin-1") if isinstance(value, bytes) else "",
)
def test_what_is_no_json_is_refused_with_the_place(live: TestClient, body: bytes, word: str) -> None:
    answer = live.post("/v1/layouts", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 400
    assert answer.json()["code"] == "invalid-json"
    assert word in answer.json()["detail"]


@pytest.mark.parametrize("body", ["[]", '"line"', "null", "7"])
def test_what_is_no_object_is_refused(live: TestClient, body: str) -> None:
    answer = live.post("/v1/layouts", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422
    assert "object" in answer.json()["errors"][0]["detail"]


def test_a_body_beyond_the_limit_is_refused(live: TestClient) -> None:
    body = b" " * 9_000_000
    answer = live.post("/v1/layouts", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 413
    assert answer.headers["content-type"] == "application/problem+json"
    assert "DUOCELL_MAX_BODY" in answer.json()["errors"][0]["detail"]


def test_thousands_of_bad_poses_are_not_answered_with_thousands_of_sentences(live: TestClient) -> None:
    request = copy.deepcopy(EXAMPLE) | {"task": {"poses": [{}] * 3000}}
    answer = live.post("/v1/layouts", json=request)
    assert answer.status_code == 422
    pointers = [error["pointer"] for error in answer.json()["errors"]]
    assert pointers == ["/task/poses/0/position", "/task/poses/0/orientation"]


def kilometres_away(request: Document) -> None:
    for end in ("start", "end"):
        request["task"]["line"][end]["position"][0] += 5000.0


def far_apart(request: Document) -> None:
    request["task"]["line"]["end"]["position"][1] += 9.0


def narrow_limits(request: Document) -> None:
    request["arms"][0]["limits"] = [[0.17, 0.18], [-0.4, -0.39], [2.7, 2.71], [0.52, 0.53], [0.17, 0.18], [0.17, 0.18]]


def no_room(request: Document) -> None:
    request["arms"][0]["base"] = {"x": 30.0, "y": 30.0, "z": 0.0, "yaw": 0.0}


def tiny_steps(request: Document) -> None:
    request["max_joint_step"] = 1e-6


def well_conditioned(request: Document) -> None:
    request["arms"][0]["min_conditioning"] = 1.0


def through_the_base(request: Document) -> None:
    request["arms"][0]["base"] = {"x": 0.9, "y": 0.5, "z": 0.1, "yaw": 0.0}


@pytest.mark.parametrize(
    "absurd", [kilometres_away, far_apart, narrow_limits, no_room, tiny_steps, well_conditioned, through_the_base]
)
def test_an_absurd_cell_is_infeasible_with_reasons(live: TestClient, absurd: Spoil) -> None:
    request = copy.deepcopy(EXAMPLE) | {"certificate": None}
    for arm in request["arms"]:
        arm["reference"] = None
    request["task"]["line"]["count"] = 4
    absurd(request)
    answer = live.post("/v1/layouts", json=request, headers={"Prefer": "wait=60"})
    assert answer.status_code == 200, answer.text
    layout = answer.json()
    assert layout["status"] == "succeeded", layout["error"]
    said = ("infeasible", "unknown") if absurd is well_conditioned else ("infeasible",)  # no proof was asked for
    assert layout["result"]["outcome"] in said
    assert layout["result"]["objective"] is None
    assert layout["result"]["reasons"]
    for reason in layout["result"]["reasons"]:
        assert reason["arm"] in ("main", "follower") or reason["kind"] == "not_found"
        assert reason["kind"]
        assert reason["detail"]
