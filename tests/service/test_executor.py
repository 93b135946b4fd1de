"""Real workers: they solve, they die, others take over; and the whole way over HTTP."""

import asyncio
import copy
import json
import multiprocessing
import os
import signal
import time
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.accept import accept
from service.executor import ProcessExecutor, SolveFailed
from service.schemas.request import EXAMPLE
from service.settings import Settings

Document = dict[str, Any]


def body(count: int) -> bytes:
    """A request that takes the longer the more poses it has."""
    request = copy.deepcopy(EXAMPLE) | {"certificate": None}
    request["task"]["line"]["count"] = count
    return json.dumps(request).encode()


LONG = accept(body(3000), Settings())


def workers() -> set[int]:
    """Process ids of all workers, those of the shared service included."""
    return {process.pid for process in multiprocessing.active_children() if process.pid is not None}


def test_workers_die_and_others_take_over() -> None:
    """One pool for the whole story: starting one takes a second."""
    others = workers()

    async def story() -> None:
        executor = ProcessExecutor(1)
        executor.start()
        try:
            await executor.self_test()
            assert len(workers() - others) == 2
            await killed_in_the_middle(executor, others)
            await executor.self_test()
            await too_slow(executor)
            await killed_while_idle(executor, others)
            await executor.self_test()
            assert len(workers() - others) == 2
        finally:
            executor.stop()
        assert workers() <= others

    asyncio.run(story())


def kill(pids: set[int]) -> None:
    for pid in pids:
        os.kill(pid, signal.SIGKILL)


async def killed_in_the_middle(executor: ProcessExecutor, others: set[int]) -> None:
    solving = asyncio.create_task(executor.solve(LONG.text, LONG.request_hash, 60.0, 60.0))
    await asyncio.sleep(0.3)
    kill(workers() - others)
    with pytest.raises(SolveFailed) as caught:
        await asyncio.wait_for(solving, 10.0)
    assert caught.value.code == "worker-died"
    assert "SIGKILL" in caught.value.detail


async def too_slow(executor: ProcessExecutor) -> None:
    began = time.monotonic()
    with pytest.raises(SolveFailed) as caught:
        await executor.solve(LONG.text, LONG.request_hash, 60.0, 0.2)
    assert caught.value.code == "time-limit"
    assert time.monotonic() - began < 10.0


async def killed_while_idle(executor: ProcessExecutor, others: set[int]) -> None:
    kill(workers() - others)
    accepted = accept(body(3), Settings())
    solving = executor.solve(accepted.text, accepted.request_hash, 30.0, 60.0)
    answer = await asyncio.wait_for(solving, 30.0)
    assert answer.outcome == "optimal"


def ready(client: TestClient) -> None:
    for _ in range(600):
        if client.get("/readyz").status_code == 200:
            return
        time.sleep(0.05)
    raise AssertionError(client.get("/readyz").json())


def test_the_example_is_solved_over_http(live: TestClient) -> None:
    ready(live)
    request = copy.deepcopy(EXAMPLE) | {"certificate": None}
    answer = live.post("/v1/layouts", json=request, headers={"Prefer": "wait=60"})
    assert answer.status_code == 200
    result = answer.json()["result"]
    assert result["outcome"] == "optimal"
    assert [len(arm["joints"]) for arm in result["arms"]] == [10, 10]
    assert result["verification"]["max_position_error"] < 1e-6
    assert result["verification"]["limits_respected"]
    again = live.post("/v1/layouts", json=request, headers={"Prefer": "wait=60"}).json()["result"]
    for answered in (result, again):
        answered["search"]["wall_time"] = 0.0
    assert again == result


def test_other_requests_are_answered_during_a_solve(live: TestClient) -> None:
    ready(live)
    location = live.post("/v1/layouts", content=body(600), headers={"Content-Type": "application/json"}).headers[
        "location"
    ]
    answers = 0
    while live.get(location).json()["status"] in ("queued", "running"):
        assert live.get("/healthz").status_code == 200
        assert live.get("/readyz").status_code == 200
        answers += 1
    assert answers >= 3
    assert live.get(location).json()["status"] == "succeeded"
