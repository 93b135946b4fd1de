"""POST /v1/layouts/evaluate: the same result as of a solve, at once, and nothing is kept."""

import copy
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.requests.accept import hash_of
from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE
from duocell.service.schemas.request import EXAMPLE
from duocell.service.workers.executor import SolveFailed

Document = dict[str, Any]
WAIT = {"Prefer": "wait=30"}


@pytest.fixture
def placed() -> Document:
    return copy.deepcopy(EVALUATE_EXAMPLE)


def test_a_layout_that_was_asked_for_evaluates_to_itself(live: TestClient, example: Document) -> None:
    example["task"]["line"]["count"] = 4
    example["obstacles"] = [{"name": "floor", "pose": at(-0.8), "shape": {"type": "half_space"}}]
    solved = live.post("/v1/layouts", json=example, headers=WAIT).json()["result"]
    for joints in (False, True):
        request = copy.deepcopy(example)
        for arm, found in zip(request["arms"], solved["arms"], strict=True):
            x, y, z = found["base"]["position"]
            arm["base"] = {"x": x, "y": y, "z": z, "yaw": found["base"]["yaw"]}
            arm["joints"] = found["joints"] if joints else None
        answer = live.post("/v1/layouts/evaluate", json=request)
        assert answer.status_code == 200, answer.text
        result = answer.json()["result"]
        assert result["outcome"] == "feasible"
        assert result["objective"] == pytest.approx(solved["objective"], rel=1e-9)
        assert set(result) == set(solved)
        for mine, theirs in zip(result["arms"], solved["arms"], strict=True):
            assert mine["joints"] == [pytest.approx(row, abs=1e-6) for row in theirs["joints"]]
        for kind, theirs in solved["clearances"].items():
            mine = result["clearances"][kind]
            assert (mine is None) == (theirs is None)
            assert mine is None or mine["distance"] == pytest.approx(theirs["distance"], abs=1e-6)


def test_a_pedestal_as_high_as_the_base_that_was_found_evaluates_to_the_same(live: TestClient) -> None:
    """Nothing that ends at the floor counts against it, at whatever distance it would have to be kept."""
    request = copy.deepcopy(EXAMPLE) | {
        "obstacles": [
            {"name": "floor", "pose": at(-0.4), "shape": {"type": "half_space"}},
            {"name": "plate", "pose": at(-0.41), "shape": {"type": "box", "size": [9.0, 9.0, 0.02]}},
        ],
        "clearance": {"arm_obstacle": 0.02},
    }
    request["task"]["line"]["count"] = 4
    request["arms"] = request["arms"][:1]
    request["arms"][0] |= {"pedestal": {"foot": -0.4, "footprint": {"radius": 0.1}}}
    request["arms"][0]["base"]["z"] = [-0.3, 0.1]
    solved = live.post("/v1/layouts", json=request, headers=WAIT).json()["result"]
    assert solved["outcome"] in ("optimal", "feasible"), solved["reasons"]
    (found,) = solved["arms"]
    x, y, z = found["base"]["position"]
    assert -0.3 <= z <= 0.1
    request["arms"][0]["base"] = {"x": x, "y": y, "z": z, "yaw": found["base"]["yaw"]}
    del request["arms"][0]["pedestal"]["foot"]
    short = live.post("/v1/layouts/evaluate", json=request)
    assert short.status_code == (200 if z > 0.0 else 422)
    request["arms"][0]["pedestal"]["foot"] = -0.4
    result = live.post("/v1/layouts/evaluate", json=request).json()["result"]
    assert result["outcome"] == "feasible", result["reasons"]
    assert result["objective"] == pytest.approx(solved["objective"], rel=1e-9)
    distances = [one["clearances"]["arm_obstacle"]["distance"] for one in (result, solved)]
    assert distances[0] == pytest.approx(distances[1], abs=1e-6)


def at(z: float) -> Document:
    return {"position": [0.0, 0.0, z], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}


def test_a_collision_is_an_answer(live: TestClient, placed: Document) -> None:
    base = placed["arms"][0]["base"]
    pose = at(0.0) | {"position": [base["x"], base["y"], 0.0]}
    placed["obstacles"] = [{"name": "post", "pose": pose, "shape": {"type": "sphere", "radius": 0.2}}]
    result = live.post("/v1/layouts/evaluate", json=placed).json()["result"]
    assert result["outcome"] == "infeasible"
    assert result["proved"] is True
    found = result["clearances"]["arm_obstacle"]
    assert found["distance"] < 0.0
    assert found["pair"][1] == "post"
    (reason,) = [reason for reason in result["reasons"] if reason["kind"] == "collision"]
    assert reason["amount"] == pytest.approx(-found["distance"])


def test_the_answer_holds_the_request_and_its_hash(client: TestClient, placed: Document) -> None:
    answer = client.post("/v1/layouts/evaluate", json=placed | {"name": 'a "quoted" name'}).json()
    assert answer["name"] == answer["request"]["name"] == 'a "quoted" name'
    assert answer["request"]["arms"][0]["joints"] is None
    assert answer["result"]["request_hash"] == hash_of(answer["request"])
    assert client.post("/v1/layouts/evaluate", json=answer["request"]).json() == answer


def test_nothing_is_kept(client: TestClient, placed: Document) -> None:
    assert client.post("/v1/layouts/evaluate", json=placed).status_code == 200
    assert client.get("/v1/layouts").json()["items"] == []
    assert client.get("/v1/layouts/evaluate").status_code == 404


def test_other_requests_are_answered_meanwhile(client: TestClient, fake: Any, placed: Document) -> None:
    fake.seconds = 1.0
    with ThreadPoolExecutor(2) as threads:
        slow = threads.submit(client.post, "/v1/layouts/evaluate", json=placed)
        time.sleep(0.2)
        began = time.monotonic()
        assert client.get("/healthz").status_code == 200
        assert time.monotonic() - began < 0.5
        assert slow.result().status_code == 200


def test_too_many_at_the_same_time_are_told_to_come_back(
    client_with: Callable[..., TestClient], fake: Any, placed: Document
) -> None:
    client = client_with(max_evaluations=1, evaluate_limit=7.0)
    fake.seconds = 1.0
    with ThreadPoolExecutor(1) as threads:
        slow = threads.submit(client.post, "/v1/layouts/evaluate", json=placed)
        time.sleep(0.3)
        refused = client.post("/v1/layouts/evaluate", json=placed)
        assert (refused.status_code, refused.json()["code"]) == (429, "evaluations-full")
        assert refused.headers["retry-after"] == "1"
        assert slow.result().status_code == 200
    assert fake.limits[-1][1] == 7.0
    fake.seconds = 0.0
    assert client.post("/v1/layouts/evaluate", json=placed).status_code == 200


@pytest.mark.parametrize(
    ("failure", "status", "code"),
    [
        ("time-limit", 503, "evaluation-failed"),
        ("worker-died", 503, "evaluation-failed"),
        ("internal", 500, "internal"),
        ("solver-failure", 500, "solver-failure"),
    ],
)
def test_failures_are_problems(
    client: TestClient, fake: Any, placed: Document, failure: str, status: int, code: str
) -> None:
    fake.failure = SolveFailed(failure, "Something happened.")
    answer = client.post("/v1/layouts/evaluate", json=placed)
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert answer.headers["content-type"] == "application/problem+json"


def test_fields_of_the_search_are_accepted(client: TestClient, placed: Document) -> None:
    placed |= {"certificate": {"gap": 0.1}, "alternatives": 3, "explain": True, "tolerance": {"position": 0.001}}
    assert client.post("/v1/layouts/evaluate", json=placed).status_code == 200
