"""Real workers: they solve, they stop when told to, they die, others take over; and the whole way over HTTP."""

import asyncio
import copy
import json
import multiprocessing
import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.requests.accept import accept
from duocell.service.schemas.request import EXAMPLE
from duocell.service.settings import Settings
from duocell.service.workers.answer import Answer
from duocell.service.workers.executor import SolveFailed, Task, WorkerDied
from duocell.service.workers.pool import GRACE, ProcessExecutor

Document = dict[str, Any]


def body(count: int) -> bytes:
    """A request that takes the longer the more poses it has."""
    request = copy.deepcopy(EXAMPLE) | {"certificate": None}
    request["task"]["line"]["count"] = count
    return json.dumps(request).encode()


def task(count: int, stop_after: float = 60.0) -> Task:
    accepted = accept(body(count), Settings())
    return Task(accepted.prepared, accepted.request_hash, 60.0, stop_after)


SHORT, LONG = task(3), task(3000)


class Events(list[tuple[str, str]]):
    """What a solve has told."""

    def __call__(self, kind: str, data: str) -> None:
        self.append((kind, data))

    async def first(self) -> None:
        """Return when the solve has begun."""
        while not self:
            await asyncio.sleep(0.01)


def pids(executor: ProcessExecutor) -> set[int]:
    return {worker.pid for worker in executor.workers if worker.pid is not None}


def running(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def parent(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])


async def settled(executor: ProcessExecutor, workers: int) -> None:
    async with asyncio.timeout(30.0):
        while executor.alive() < workers:
            await asyncio.sleep(0.01)


def test_workers_solve_stop_die_and_are_replaced() -> None:
    """One pool for the whole story: starting one takes a second."""

    async def story() -> None:
        executor = ProcessExecutor(2)
        executor.start()
        try:
            await executor.self_test()
            await settled(executor, 3)
            await tells_what_it_does(executor)
            await stops_when_told_to(executor)
            await too_slow(executor)
            await killed_in_the_middle(executor)
            await killed_while_idle(executor)
            await without_a_place_to_fork_from(executor)
        finally:
            everybody = pids(executor)
            await executor.stop()
        assert everybody
        assert not any(running(pid) for pid in everybody)

    asyncio.run(story())


async def tells_what_it_does(executor: ProcessExecutor) -> None:
    events = Events()
    answer = await executor.solve(SHORT, events)
    assert answer.text is not None
    assert json.loads(answer.text)["objective"] == answer.objective
    kinds = [kind for kind, _ in events]
    assert kinds[0] == "stage"
    assert kinds.count("verification") == 1
    assert {"screening", "start", "iteration"} <= set(kinds)
    assert json.loads(events[-1][1])["limits_respected"] is True


async def stops_when_told_to(executor: ProcessExecutor) -> None:
    """The worker is kept, and comes back at once."""
    before, events = pids(executor), Events()
    solving = asyncio.create_task(executor.solve(task(400), events))
    await events.first()
    began = time.monotonic()
    solving.cancel()
    with pytest.raises(asyncio.CancelledError):
        await solving
    assert time.monotonic() - began < GRACE + 0.3
    told = len(events)
    await executor.solve(SHORT, lambda kind, data: None)
    assert len(events) == told  # nothing comes late
    assert pids(executor) == before
    assert executor.deaths == 0


async def too_slow(executor: ProcessExecutor) -> None:
    """The answer is what is known then, whatever that is."""
    events = Events()
    answer = await executor.solve(task(3000, 0.3), events)
    assert answer.text is not None
    assert answer.ended_by == "time-limit"
    assert answer.outcome in ("unknown", "feasible")
    assert json.loads(answer.text)["reasons"][0]["kind"] == "limit_reached"
    assert "known" not in [kind for kind, _ in events]


async def killed_in_the_middle(executor: ProcessExecutor) -> None:
    """The solve next to it does not notice."""
    await settled(executor, 3)
    deaths = executor.deaths
    doomed, spared = Events(), Events()
    first = asyncio.create_task(executor.solve(LONG, doomed))
    await doomed.first()
    victim = executor.busy()
    second = asyncio.create_task(executor.solve(task(60), spared))
    await spared.first()
    (pid,) = {worker.pid for worker in victim}
    assert pid is not None
    os.kill(pid, signal.SIGKILL)
    with pytest.raises(WorkerDied, match="SIGKILL"):
        await asyncio.wait_for(first, 10.0)
    assert (await second).outcome in ("optimal", "feasible")
    await settled(executor, 3)
    assert executor.deaths == deaths + 1


async def killed_while_idle(executor: ProcessExecutor) -> None:
    await settled(executor, 3)
    for pid in pids(executor):
        os.kill(pid, signal.SIGKILL)
    await executor.self_test()
    answer = await asyncio.wait_for(executor.solve(SHORT, lambda kind, data: None), 30.0)
    assert answer.outcome in ("optimal", "feasible")


async def without_a_place_to_fork_from(executor: ProcessExecutor) -> None:
    """The process that workers are forked from dies, and so do they: another one is started."""
    await settled(executor, 3)
    (first, *_) = pids(executor)
    forker = parent(first)
    for pid in (forker, *pids(executor)):
        os.kill(pid, signal.SIGKILL)
    await asyncio.wait_for(executor.self_test(), 60.0)
    await settled(executor, 3)
    assert forker not in pids(executor)


def deaf(*arguments: Any) -> Answer:
    """A solve deep in foreign code: it never asks whether to go on."""
    time.sleep(60.0)
    return Answer("{}")


def crashing(*arguments: Any) -> Answer:
    os.kill(os.getpid(), signal.SIGSEGV)
    return Answer("{}")


def test_who_does_not_listen_is_killed_after_a_grace() -> None:
    async def story() -> None:
        executor = ProcessExecutor(1, solve=deaf)
        try:
            await executor.self_test()
            solving = asyncio.create_task(executor.solve(SHORT, lambda kind, data: None))
            await asyncio.sleep(0.1)
            (victim,) = executor.busy()
            began = time.monotonic()
            solving.cancel()
            with pytest.raises(asyncio.CancelledError):
                await solving
            assert GRACE - 0.1 < time.monotonic() - began < GRACE + 0.3
            assert not running(victim.pid or 0)
            await executor.self_test()
        finally:
            await executor.stop()

    asyncio.run(story())


def test_what_was_known_is_the_answer_of_a_solve_that_has_to_be_killed() -> None:
    async def story() -> None:
        executor = ProcessExecutor(1, solve=deaf_but_telling)
        try:
            await executor.self_test()
            answer = await executor.solve(task(3, 5.0), lambda kind, data: None)
            assert json.loads(answer.text or "") == {"number": 2}
            assert (answer.outcome, answer.objective, answer.ended_by) == ("feasible", 2.5, "time-limit")
            await executor.self_test()
        finally:
            await executor.stop()

    asyncio.run(story())


def deaf_but_telling(*arguments: Any) -> Answer:
    """Tells of two answers, and never of a third."""
    from duocell.optimizer.monitoring.watch import tell
    from duocell.service.workers.best_known import KnownAnswer

    for number in (1, 2):
        tell(KnownAnswer(json.dumps(Answer(json.dumps({"number": number}), "feasible", number + 0.5, "0"))))
    return deaf()


def test_workers_can_be_ended_when_the_process_they_were_forked_from_is_gone() -> None:
    """`multiprocessing` takes its children for dead then; a solve beyond its time must be killed all the same."""

    async def story() -> None:
        executor = ProcessExecutor(1, solve=deaf)
        try:
            await executor.self_test()
            await settled(executor, 2)
            forker = parent(min(pids(executor)))
            os.kill(forker, signal.SIGKILL)
            while running(forker):
                await asyncio.sleep(0.01)
            multiprocessing.active_children()  # looks at all of them, as does the start of any process
            began = time.monotonic()
            with pytest.raises(SolveFailed) as caught:
                await executor.solve(task(3, 0.1), lambda kind, data: None)
            assert caught.value.code == "time-limit"
            assert time.monotonic() - began < 0.1 + GRACE + 10.0
        finally:
            everybody = pids(executor)
            await asyncio.wait_for(executor.stop(), 10.0)
        assert everybody
        ends = time.monotonic() + 20.0  # who has lost the parent is reaped by somebody else, in time
        while any(running(pid) for pid in everybody):
            assert time.monotonic() < ends
            await asyncio.sleep(0.02)

    asyncio.run(story())


def test_a_crash_is_told_by_its_signal() -> None:
    async def story() -> None:
        executor = ProcessExecutor(1, solve=crashing)
        try:
            for _ in range(2):
                with pytest.raises(WorkerDied, match="SIGSEGV"):
                    await executor.solve(SHORT, lambda kind, data: None)
            await executor.self_test()
        finally:
            await executor.stop()

    asyncio.run(story())


def ready(client: TestClient) -> None:
    for _ in range(600):
        if client.get("/readyz").status_code == 200:
            return
        time.sleep(0.05)
    raise AssertionError(client.get("/readyz").json())


def test_the_example_is_solved_over_http(live: TestClient) -> None:
    ready(live)
    request = copy.deepcopy(EXAMPLE) | {"certificate": "auto"}
    answer = live.post("/v1/layouts", json=request, headers={"Prefer": "wait=60"})
    assert answer.status_code == 200
    result = answer.json()["result"]
    assert result["outcome"] == "optimal"
    assert [len(arm["joints"]) for arm in result["arms"]] == [10, 10]
    assert result["verification"]["max_position_error"] < 1e-6
    assert result["verification"]["limits_respected"]
    again = live.post("/v1/layouts", json=request, headers={"Prefer": "wait=60"}).json()["result"]
    for answered in (result, again):
        answered["search"]["wall_time"] = answered["search"]["first_feasible_time"] = 0.0
        for proof in (answered["certificate"], *answered["certificate"]["arms"]):
            proof["wall_time"] = 0.0
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
