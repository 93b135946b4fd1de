"""What Prometheus gets to see: parsed by the client library's own parser, counted against what was done."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from fastapi.testclient import TestClient
from prometheus_client.parser import text_string_to_metric_families

from duocell.service.common.version import package_version
from duocell.service.observability import metrics
from tests.support.asgi import http_scope

Make = Callable[..., TestClient]


def scraped(client: TestClient) -> dict[tuple[str, frozenset[tuple[str, str]]], float]:
    answer = client.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain; version=")
    return {
        (sample.name, frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def value(found: dict[Any, float], name: str, **labels: str) -> float:
    return found.get((name, frozenset(labels.items())), 0.0)


def test_requests_are_counted_by_route_method_and_status(client: TestClient, example: dict[str, Any]) -> None:
    before = scraped(client)
    client.post("/v1/layouts", json=example)
    for name in ("none", "no-such", "neither"):
        client.get(f"/v1/layouts/{name}")
    client.get("/static/none.js")
    client.get("/openapi.json")
    client.delete("/v1/layouts")
    client.get("/some/where/else")
    client.request("BREW", "/v1/layouts")
    after = scraped(client)
    for route, method, status, count in (
        ("/v1/layouts", "POST", "202", 1),
        ("/v1/layouts/{layout_id}", "GET", "404", 3),
        ("/static/{path}", "GET", "404", 1),
        ("/openapi.json", "GET", "200", 1),
        ("/v1/layouts", "DELETE", "405", 1),
        ("none", "GET", "404", 1),
        ("/v1/layouts", "other", "405", 1),
    ):
        labels = {"route": route, "method": method, "status": status}
        name = "duocell_http_request_duration_seconds_count"
        assert value(after, name, **labels) - value(before, name, **labels) == count, labels
    routes = {dict(labels)["route"] for name, labels in after if name == "duocell_http_request_duration_seconds_count"}
    assert not [route for route in routes if "no-such" in route or "some" in route]


def test_durations_are_in_seconds(client_with: Make, fake: Any, example: dict[str, Any]) -> None:
    fake.seconds = 0.3
    client = client_with()
    labels = {"route": "/v1/layouts", "method": "POST", "status": "200"}
    before = scraped(client)
    client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"})
    after = scraped(client)
    name = "duocell_http_request_duration_seconds"
    spent = value(after, f"{name}_sum", **labels) - value(before, f"{name}_sum", **labels)
    assert 0.3 <= spent < 3.0
    slower = value(after, f"{name}_bucket", **labels, le="0.25") - value(before, f"{name}_bucket", **labels, le="0.25")
    assert slower == 0.0


def test_solves_are_counted_by_outcome(client: TestClient) -> None:
    before = scraped(client)
    metrics.job_finished("optimal", 0.2)
    metrics.job_finished("infeasible", 3.0)
    metrics.job_finished("time-limit", 70.0)
    metrics.reported("start", '{"arm": "main", "start": 1, "iterations": 40}')
    metrics.reported("start", '{"arm": "main", "start": 2, "iterations": 2}')
    metrics.reported("iteration", '{"iterations": 7}')
    metrics.worker_died(-9)
    metrics.worker_died(3)
    after = scraped(client)

    def change(name: str, **labels: str) -> float:
        return value(after, name, **labels) - value(before, name, **labels)

    for outcome, seconds in (("optimal", 0.2), ("infeasible", 3.0), ("time-limit", 70.0)):
        assert change("duocell_solve_duration_seconds_count", outcome=outcome) == 1
        assert change("duocell_solve_duration_seconds_sum", outcome=outcome) == pytest.approx(seconds)
    assert change("duocell_solver_starts_total") == 2
    assert change("duocell_solver_iterations_total") == 42
    assert change("duocell_worker_deaths_total", cause="SIGKILL") == 1
    assert change("duocell_worker_deaths_total", cause="exit 3") == 1


def test_gauges_are_read_when_they_are_asked_for(client: TestClient) -> None:
    assert value(scraped(client), "duocell_workers_alive") == 1.0  # the fake executor's
    depth = 3
    metrics.watch(queued=lambda: depth, running=lambda: 2)
    assert value(scraped(client), "duocell_jobs_queued") == 3.0
    depth = 5
    found = scraped(client)
    assert value(found, "duocell_jobs_queued") == 5.0
    assert value(found, "duocell_jobs_running") == 2.0
    assert value(found, "duocell_workers_alive") == 1.0


def test_the_process_and_the_version_are_there(client: TestClient) -> None:
    found = scraped(client)
    assert value(found, "duocell_build_info", version=package_version()) == 1.0
    assert value(found, "process_resident_memory_bytes") > 1e7
    assert value(found, "process_open_fds") > 0


def test_a_client_that_leaves_is_499(client: TestClient) -> None:
    """Driven by hand: test clients stay until they are answered."""

    async def leave() -> list[dict[str, Any]]:
        sent: list[dict[str, Any]] = []

        async def receive() -> dict[str, Any]:
            return {"type": "http.disconnect"}

        async def send(message: Any) -> None:
            sent.append(message)

        await client.app(http_scope("POST", "/v1/layouts"), receive, send)
        return sent

    labels = {"route": "/v1/layouts", "method": "POST", "status": "499"}
    before = value(scraped(client), "duocell_http_request_duration_seconds_count", **labels)
    assert asyncio.run(leave()) == []
    assert value(scraped(client), "duocell_http_request_duration_seconds_count", **labels) == before + 1
