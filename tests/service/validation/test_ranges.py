"""Numbers out of every range: refused at their place, with a sentence that is true of them."""

import copy
import json
from math import pi
from typing import Any

import pytest

from duocell.service.common.issues import InvalidRequest
from duocell.service.requests.accept import accept, accept_evaluation
from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE
from duocell.service.schemas.request import EXAMPLE
from duocell.service.schemas.task import ARC_END, ARC_START, LINE
from duocell.service.settings import Limits

Document = dict[str, Any]
ARC = {"start": ARC_START, "end": ARC_END, "radius": 0.9, "normal": [0, 0, 1e308], "count": 5}
PLATE = {"size": [0.4, 0.4]}


def issues(request: Document) -> dict[str, str]:
    with pytest.raises(InvalidRequest) as refused:
        accept(json.dumps(request).encode(), Limits())
    return {issue.pointer: issue.detail for issue in refused.value.issues}


def of_arm(**fields: Any) -> Document:
    request = copy.deepcopy(EXAMPLE)
    request["arms"][0] |= fields
    return request


def of_jobs(weight: float) -> Document:
    jobs = [{"name": "a", "task": {"line": LINE}, "weight": weight}]
    return {name: value for name, value in EXAMPLE.items() if name != "task"} | {"tasks": jobs}


TIE = {"arms": ["main", "follower"]}
CASES: dict[str, tuple[Document, str, str]] = {
    "a weight that makes costs infinite": (of_arm(weights=[1e308] * 6), "/arms/0/weights/0", "at most"),
    "a weight that vanishes": (of_arm(weights=[1e-320] * 6), "/arms/0/weights/0", "1e-06"),
    "a job of a weight that vanishes": (of_jobs(1e-320), "/tasks/0/weight", "1e-06"),
    "joints without a range": (
        of_arm(limits=[[0.0, 1e-9]] * 6, reference=[0.0] * 6),
        "/arms/0/limits/5",
        "0.0001 rad below",
    ),
    "a clearance beyond all numbers": (EXAMPLE | {"clearance": {"arm_arm": 1e308}}, "/clearance/arm_arm", "more than"),
    "a clearance in millimetres": (EXAMPLE | {"clearance": {"self": 30}}, "/clearance/self", "send 0.03"),
    "a margin in millimetres": (EXAMPLE | {"floor": {"margin": 50}}, "/floor/margin", "send 0.05"),
    "a distance in millimetres": (
        EXAMPLE | {"coupling": [TIE | {"type": "distance", "maximum": 1e5}]},
        "/coupling/0/maximum",
        "metres",
    ),
    "a normal beyond all numbers": (EXAMPLE | {"task": {"arc": ARC}}, "/task/arc/normal", "unit vector"),
    "a mount in degrees": (of_arm(mount={"roll": 45.0, "pitch": 0.0}), "/arms/0/mount/roll", "0.785398"),
    "a direction in degrees": (
        EXAMPLE | {"coupling": [TIE | {"type": "direction", "angle": 45}]},
        "/coupling/0/angle",
        "0.785398",
    ),
    "a stand in millimetres": (
        EXAMPLE | {"coupling": [TIE | {"type": "rigid", "x": 800.0, "y": [-1e5, 0.0]}]},
        "/coupling/0/y/0",
        "metres",
    ),
    "a stand in degrees": (
        EXAMPLE | {"coupling": [TIE | {"type": "rigid", "x": 1.0, "y": 0.0, "yaw": [0.0, 45.0]}]},
        "/coupling/0/yaw",
        "0.785398",
    ),
    "a pedestal of a nanometre": (
        of_arm(pedestal={"height": 1e-9, "footprint": PLATE}),
        "/arms/0/pedestal/height",
        "1e-06 and 1000 m",
    ),
    "a pedestal as thin as a hair's hair": (
        of_arm(pedestal={"height": 0.5, "foot": -0.5, "footprint": {"polygon": [[0, 0], [1, 0], [1, 1e-8]]}}),
        "/arms/0/pedestal/footprint",
        "thinner than",
    ),
    "a pedestal of a round nanometre": (
        of_arm(pedestal={"height": 0.5, "foot": -0.5, "footprint": {"radius": 1e-9}}),
        "/arms/0/pedestal/footprint",
        "1e-09",
    ),
    "a distance that is none": (
        EXAMPLE | {"coupling": [TIE | {"type": "distance", "minimum": 2.0, "maximum": 1.0}]},
        "/coupling/0/minimum",
        "minimum <= maximum",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_numbers_out_of_range_are_refused_at_their_place(name: str) -> None:
    request, pointer, words = CASES[name]
    found = issues(request)
    assert pointer in found, found
    assert words in found[pointer]


def test_no_sentence_says_of_a_large_number_that_it_is_negative() -> None:
    for request, _, _ in CASES.values():
        assert all("negative" not in detail for detail in issues(request).values())


@pytest.mark.parametrize("weights", [[1e-6] * 6, [1e6] * 6, [0.0, 1.0, 1e-6, 1e6, 0.0, 1.0]])
def test_weights_within_the_range_are_taken(weights: list[float]) -> None:
    accept(json.dumps(of_arm(weights=weights)).encode(), Limits())


def test_joint_values_of_an_evaluation_are_angles() -> None:
    request = copy.deepcopy(EVALUATE_EXAMPLE)
    request["arms"][0]["joints"] = [[0.0] * 6] * 3 + [[0.0, 180.0, 0.0, 0.0, 0.0, 0.0]] + [[0.0] * 6] * 6
    with pytest.raises(InvalidRequest) as refused:
        accept_evaluation(json.dumps(request).encode(), Limits())
    assert [issue.pointer for issue in refused.value.issues] == ["/arms/0/joints/3/1"]


def test_half_a_turn_of_mount_is_fine() -> None:
    accept(json.dumps(of_arm(mount={"roll": pi, "pitch": 0.0})).encode(), Limits())
