"""Everything that is no layout: robots, health, problems, the page of documentation."""

import asyncio
import re
import time
from collections.abc import Callable
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.models.base import errors
from duocell.models.catalogue import catalogue
from duocell.service.app import create_app
from duocell.service.common.problems import KINDS
from duocell.service.library.robots import load_catalogue
from duocell.service.settings import Settings
from duocell.service.workers.executor import SolveFailed
from duocell.service.workers.import_worker import ImportWorker

Make = Callable[..., TestClient]


def test_the_catalogue_is_listed(client: TestClient) -> None:
    page = client.get("/v1/robots").json()
    assert [robot["name"] for robot in page["items"]] == catalogue.names()
    assert all(robot["reach"] > 0.1 and robot["dof"] in (6, 7) and robot["title"] for robot in page["items"])


def test_the_catalogue_is_the_same_from_the_process_that_loads_it(client: TestClient) -> None:
    async def listed() -> object:
        import_worker = ImportWorker(60.0)
        try:
            return await import_worker.run(load_catalogue)
        finally:
            await import_worker.stop()

    assert asyncio.run(listed()) == client.get("/v1/robots").json()["items"]


def test_a_robot_tells_limits_frames_and_provenance(client: TestClient) -> None:
    robot = client.get("/v1/robots/puma560").json()
    assert len(robot["joints"]) == 6
    assert robot["joints"][0]["lower"] == pytest.approx(-2.7925, abs=1e-4)
    assert robot["flange_at_zero"]["position"] == pytest.approx([0.4115, 0.1491, 0.4894], abs=1e-4)
    assert robot["base_frame"]
    assert robot["flange_frame"]
    assert any("shoulder height" in note for note in robot["notes"])
    assert robot["postures"]["wrist"]["flip"].startswith("joint_5")
    assert robot["inverse_kinematics"].startswith("closed form")
    assert robot["source"]
    assert robot["licence"]


def test_every_robot_can_be_shown(client: TestClient) -> None:
    for name in catalogue.names():
        answer = client.get(f"/v1/robots/{name}")
        assert answer.status_code == 200, name
        for joint in answer.json()["joints"]:
            assert (joint["lower"] is None) == (joint["upper"] is None)


def test_an_unknown_robot_is_answered_with_near_names(client: TestClient) -> None:
    answer = client.get("/v1/robots/ur10x")
    assert answer.status_code == 404
    assert answer.json()["code"] == "robot-not-found"
    assert "ur10e" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("method", "path", "status", "code"),
    [
        ("GET", "/nowhere", 404, "not-found"),
        ("GET", "/v1/layouts/none", 404, "layout-not-found"),
        ("GET", "/static/none.js", 404, "not-found"),
        ("GET", "/problems/none", 404, "not-found"),
        ("DELETE", "/v1/layouts", 405, "method-not-allowed"),
        ("PUT", "/v1/robots", 405, "method-not-allowed"),
        ("PUT", "/v1/layouts/none", 405, "method-not-allowed"),
    ],
)
def test_what_is_not_there_is_a_problem(client: TestClient, method: str, path: str, status: int, code: str) -> None:
    answer = client.request(method, path)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["code"] == code
    assert problem["status"] == status
    assert problem["instance"] == path
    assert problem["detail"]
    if status == 405:
        assert answer.headers["allow"]


@pytest.mark.parametrize(
    ("path", "methods"),
    [("/v1/layouts", "GET, HEAD, POST"), ("/v1/layouts/none", "DELETE, GET, HEAD"), ("/docs", "GET")],
)
def test_a_wrong_method_is_told_all_right_ones(client: TestClient, path: str, methods: str) -> None:
    assert client.request("PATCH", path).headers["allow"] == methods


def test_a_form_is_no_json(client: TestClient) -> None:
    answer = client.post("/v1/layouts", data={"name": "line"})
    assert answer.status_code == 415
    assert "Content-Type: application/json" in answer.json()["detail"]


def test_an_unexpected_error_is_a_problem_without_secrets(fake: Any) -> None:
    app = create_app(Settings(), fake)

    @app.get("/broken")
    def broken() -> None:
        raise RuntimeError("a secret")

    with TestClient(app, raise_server_exceptions=False) as client:
        answer = client.get("/broken")
    assert answer.status_code == 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["code"] == "internal"
    assert "secret" not in answer.text


def test_every_error_of_the_models_has_a_problem() -> None:
    def classes(parent: type[errors.DuocellError]) -> list[type[errors.DuocellError]]:
        return [parent, *(found for child in parent.__subclasses__() for found in classes(child))]

    assert {error.code for error in classes(errors.DuocellError)} <= set(KINDS)


def test_every_problem_is_explained(client: TestClient) -> None:
    for code, kind in KINDS.items():
        explanation = client.get(f"/problems/{code}").json()
        assert explanation["title"] == kind.title
        assert explanation["advice"]


def ready(client: TestClient) -> Any:
    for _ in range(100):
        answer = client.get("/readyz")
        if answer.status_code == 200:
            return answer.json()
        time.sleep(0.02)
    raise AssertionError(answer.json())


def test_ready_means_that_a_self_test_has_passed(client: TestClient) -> None:
    checks = ready(client)["checks"]
    assert checks["self_test"]["age"] <= 30.0
    assert checks["workers"]["alive"] == 1
    assert checks["store"]["ok"]


def test_not_ready_while_the_self_test_fails(client_with: Make, fake: Any) -> None:
    fake.unwell = SolveFailed("self-test", "The layout of the self-test is wrong by 1.")
    client = client_with(self_test_every=0.05)
    time.sleep(0.1)
    answer = client.get("/readyz")
    assert answer.status_code == 503
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["retry-after"] == "1"
    assert "wrong by 1" in answer.json()["detail"]
    assert client.get("/healthz").status_code == 200


def test_no_longer_ready_once_the_self_test_fails(client_with: Make, fake: Any) -> None:
    client = client_with(self_test_every=0.05)
    ready(client)
    fake.unwell = SolveFailed("worker-died", "The worker was ended by signal SIGKILL.")
    for _ in range(100):
        if client.get("/readyz").status_code == 503:
            break
        time.sleep(0.02)
    else:
        raise AssertionError("still ready")
    fake.unwell = None
    ready(client)


def test_an_old_self_test_proves_nothing(client_with: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    client = client_with(self_test_every=20.0)
    ready(client)
    monkeypatch.setattr("duocell.service.workers.health.MAX_AGE", 0.0)
    assert client.get("/readyz").status_code == 503


def test_the_documentation_needs_no_internet(client: TestClient) -> None:
    page = client.get("/docs")
    assert page.status_code == 200
    addresses = re.findall(r"(?:src|href)=\"([^\"]+)\"", page.text)
    assert len(addresses) >= 2
    for address in addresses:
        assert address.startswith(("/", "data:")), address
        if address.startswith("/"):
            assert client.get(address).status_code == 200
    assert not re.search(r"url\([\"']?https?:", client.get("/static/swagger-ui/swagger-ui.css").text)
