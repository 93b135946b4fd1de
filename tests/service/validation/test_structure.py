"""Documents that would become gigabytes are refused by their bytes; no request within the limits is."""

import copy
import json
import tracemalloc
from typing import Any

import pytest

from duocell.service.common.issues import InvalidRequest
from duocell.service.common.problems import response
from duocell.service.http.error_handlers import as_problem
from duocell.service.requests.accept import accept, accept_evaluation
from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE
from duocell.service.schemas.request import EXAMPLE
from duocell.service.settings import Limits
from duocell.service.validation.strict_json import NotJson
from duocell.service.validation.structure import check_structure

POSE = {"position": [0.8, 0.4, 0.1], "orientation": {"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}
SMALL = Limits(max_poses=60, max_obstacles=5, max_shapes=2, max_polygons=2, max_corners=9, max_couplings=3)
"""The bounds on the structure follow from these; hostile documents can then be small."""

Document = dict[str, Any]


def example(**fields: Any) -> Document:
    return copy.deepcopy(EXAMPLE) | {"certificate": None} | fields


def first_arm(**fields: Any) -> Document:
    request = example()
    request["arms"][0] |= fields
    return request


HOSTILE: dict[str, bytes] = {
    "empty objects": b"[" + b"{}," * 100_000 + b"{}]",
    "small objects": b'{"a":[' + b'{"a":0},' * 50_000 + b"0]}",
    "lists": b"[" + b"[0]," * 100_000 + b"0]",
    "numbers": b"[" + b"1," * 200_000 + b"0]",
    "brackets": b"[" * 300_000,
    "weights": json.dumps(first_arm(weights=["a"] * 60_000)).encode(),
    "unknown fields": json.dumps(example(**{f"u{k}": 0 for k in range(30_000)})).encode(),
    "unknown fields, fewer": json.dumps(example(**{f"u{k}": 0 for k in range(900)})).encode(),
    "long unknown name": json.dumps(example(**{"x" * 300_000: 0})).encode(),
    "long type": json.dumps(example(obstacles=[{"name": "t", "shape": {"type": "box" * 100_000}}])).encode(),
    "wrong poses": json.dumps(
        example(task={"poses": [{"position": ["a"] * 3, "orientation": {"matrix": [["a"] * 3] * 3}}] * 60})
    ).encode(),
    "arms of a coupling": json.dumps(example(coupling=[{"type": "same_z", "arms": ["z"] * 20_000}])).encode(),
    "grasps": json.dumps(
        {k: v for k, v in example().items() if k != "task"}
        | {"tasks": [{"name": "a", "task": EXAMPLE["task"], "grasps": {f"g{k}": POSE for k in range(500)}}]}
    ).encode(),
    "rows of joints": json.dumps(first_arm(joints=[["a"] * 7] * 60)).encode(),
    "names of arms": json.dumps(first_arm(name="x" * 300_000)).encode(),
    "grasp of an endless name": json.dumps(
        {k: v for k, v in example().items() if k != "task"}
        | {"tasks": [{"name": "a", "task": EXAMPLE["task"], "grasps": {"x" * 300_000: EXAMPLE["arms"][0]["grasp"]}}]}
    ).encode(),
}


@pytest.mark.parametrize("body", HOSTILE.values(), ids=HOSTILE)
def test_hostile_bodies_get_short_answers_and_little_memory(body: bytes) -> None:
    tracemalloc.start()
    try:
        with pytest.raises((InvalidRequest, NotJson)) as refused:
            accept(body, SMALL)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    answer = response(as_problem(refused.value)[0], "/v1/layouts")
    assert len(bytes(answer.body)) < 20_000
    assert peak < 5e6 + 20 * len(body)


def test_what_is_not_listed_is_counted() -> None:
    with pytest.raises(InvalidRequest) as refused:
        accept(HOSTILE["unknown fields, fewer"], SMALL)
    listed = json.loads(bytes(response(as_problem(refused.value)[0], "/v1/layouts").body))["errors"]
    assert len(listed) == 21
    assert listed[-1]["detail"].startswith("880 further problems")


def test_of_a_list_of_poses_the_first_that_is_wrong_is_told() -> None:
    good, bad = POSE, {**POSE, "position": [0.0, "a", "b"]}
    with pytest.raises(InvalidRequest) as refused:
        accept(json.dumps(example(task={"poses": [good, bad, bad]})).encode(), Limits())
    assert {issue.pointer for issue in refused.value.issues} == {"/task/poses/1/position/1", "/task/poses/1/position/2"}


def test_the_fullest_request_that_is_allowed_passes() -> None:
    """Jobs of two poses, a grasp of each arm in each, joint values of seven-jointed arms, all shapes and corners."""
    limits = Limits(max_poses=100, max_corners=20, max_polygons=10)
    solid = {"pose": POSE, "shape": {"type": "box", "size": [1, 1, 1]}}
    arms = [
        {
            **copy.deepcopy(EVALUATE_EXAMPLE["arms"][0]),
            "name": f"a{k}",
            "limits": [[-1, 1]] * 7,
            "weights": [1] * 7,
            "reference": [0] * 7,
            "joints": [[0] * 7] * 100,
            "tool": POSE,
            "grasp": POSE,
            "tool_shapes": [solid] * limits.max_shapes,
            "footprint": {"polygon": [[0, 0]] * limits.max_corners},
            "pedestal": {"height": 1, "footprint": {"polygon": [[0, 0]] * limits.max_corners}},
            "robot": {"dh": [{"alpha": 0, "a": 0, "d": 0, "theta_offset": 0, "lower": -1, "upper": 1}] * 7},
        }
        for k in range(limits.max_arms)
    ]
    names = [arm["name"] for arm in arms]
    full = {
        "tasks": [
            {"name": str(k), "weight": 1, "task": {"poses": [POSE, POSE]}, "grasps": dict.fromkeys(names, POSE)}
            for k in range(50)
        ],
        "arms": arms,
        "obstacles": [{"name": str(k), **solid} for k in range(limits.max_obstacles)],
        "part": {"shapes": [solid] * limits.max_shapes},
        "floor": {
            "allowed": [[0, 0]] * limits.max_corners,
            "forbidden": [[[0, 0]] * limits.max_corners] * limits.max_polygons,
        },
        "coupling": [{"type": "same_z", "arms": names}] * limits.max_couplings,
        "clearance": {"arm_arm": 0, "self": None},
    }
    check_structure(json.dumps(full).encode(), limits)


def test_an_evaluation_with_too_many_rows_is_told_so() -> None:
    request = copy.deepcopy(EVALUATE_EXAMPLE)
    request["arms"][0]["joints"] = [[0.0] * 6] * 61
    with pytest.raises(InvalidRequest, match="61 rows"):
        accept_evaluation(json.dumps(request).encode(), SMALL)
