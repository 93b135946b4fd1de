"""Large bodies are read in processes that end when they take too long; small ones, and all answers, are as before."""

import asyncio
import copy
import json
import os
import threading
import time
from pathlib import Path

import pytest

from duocell.service.common.issues import InvalidRequest
from duocell.service.common.priority import READING
from duocell.service.common.problems import Problem
from duocell.service.library.document_stores import View
from duocell.service.requests.accept import accept
from duocell.service.requests.reading import Read
from duocell.service.schemas.request import EXAMPLE
from duocell.service.settings import Limits, Settings
from duocell.service.validation.strict_json import NotJson
from duocell.service.workers import acceptance as acceptance_module
from duocell.service.workers.acceptance import SMALL, Acceptance

POSE = {"position": [0.8, 0.4, 0.1], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}


def body_of(poses: int) -> bytes:
    request = copy.deepcopy(EXAMPLE)
    request["task"] = {"poses": [POSE] * poses}
    return json.dumps(request).encode()


LARGE = body_of(1000)
assert len(LARGE) > SMALL


def test_small_bodies_are_read_here(tmp_path: Path) -> None:
    async def scenario() -> None:
        acceptance = Acceptance(Settings(data_dir=tmp_path))
        body = json.dumps(EXAMPLE).encode()
        assert await acceptance.layout(body) == accept(body, Limits())
        assert not acceptance._processes

    asyncio.run(scenario())


def test_small_bodies_are_read_one_at_a_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Threads that compute hold up the event loop, the more of them there are."""
    reading: list[int] = []
    present = threading.Semaphore(100)

    def slowly(body: bytes, limits: Limits, view: View) -> Read:
        present.acquire()
        reading.append(100 - present._value)
        time.sleep(0.01)
        present.release()
        return Read(None, not_json="no")

    monkeypatch.setattr(acceptance_module, "read_layout", slowly)

    async def scenario() -> None:
        acceptance = Acceptance(Settings(data_dir=tmp_path))
        await asyncio.gather(*(acceptance.layout(b"{") for _ in range(8)), return_exceptions=True)

    asyncio.run(scenario())
    assert reading == [1] * 8


def test_large_bodies_are_answered_alike_from_a_process_that_is_kept(tmp_path: Path) -> None:
    async def scenario() -> None:
        acceptance = Acceptance(Settings(data_dir=tmp_path))
        try:
            assert await acceptance.layout(LARGE) == accept(LARGE, Limits())
            (process,) = acceptance._processes
            assert process.pid is not None
            assert os.getpriority(os.PRIO_PROCESS, process.pid) >= READING  # the server goes first
            with pytest.raises(NotJson, match="line 1"):
                await acceptance.layout(b"{" + b" " * SMALL)
            with pytest.raises(InvalidRequest) as refused:
                await acceptance.layout(LARGE.replace(b'"robot"', b'"robto"'))
            assert {issue.pointer for issue in refused.value.issues} == {"/arms/0/robto", "/arms/1/robto"}
            assert acceptance._processes == {process}
        finally:
            await acceptance.stop()
        assert not process.alive

    asyncio.run(scenario())


def test_a_body_that_takes_too_long_ends_its_process_and_nothing_else(tmp_path: Path) -> None:
    async def scenario() -> None:
        acceptance = Acceptance(Settings(data_dir=tmp_path, accept_limit=0.05, max_poses=50_000))
        try:
            with pytest.raises(Problem, match="DUOCELL_ACCEPT_LIMIT") as refused:
                await acceptance.layout(body_of(50_000))
            assert (refused.value.code, refused.value.headers) == ("acceptance-failed", {"Retry-After": "5"})
            with pytest.raises(NotJson):
                await acceptance.layout(b"[" + b" " * SMALL)
        finally:
            await acceptance.stop()

    asyncio.run(scenario())
