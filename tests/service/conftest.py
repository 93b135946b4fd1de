"""A service with a fake executor for the contract, and one with real workers for the rest."""

import asyncio
import copy
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from duocell.optimizer.results.layout import Layout, Outcome, Search, Verification
from duocell.optimizer.results.placement import Placement
from duocell.service.app import create_app
from duocell.service.requests.prepared import request_of
from duocell.service.results.documents import result_document
from duocell.service.schemas.evaluate import EvaluateRequest
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.settings import Settings
from duocell.service.workers.answer import Answer
from duocell.service.workers.executor import Report, SolveFailed, Task


def made_up_layout(request: LayoutRequest) -> Layout:
    """A layout of the right shape with a joint that turns without end; its numbers mean nothing."""
    placements = tuple(
        Placement(
            arm=arm.name,
            position=np.array([0.1, 0.2, 0.3]),
            yaw=0.5,
            joints=np.zeros((2, 6)),
            posture=None,
            objective=1.5,
            joint_margins=np.array([1.0, 2.0, 3.0, 4.0, 5.0, np.inf]),
            minimum_margin=1.0,
            minimum_conditioning=0.1,
            characteristic_length=0.3,
            singularity_distances={},
        )
        for arm in request.arms
    )
    return Layout(
        outcome=Outcome.OPTIMAL,
        objective=1.5 * len(placements),
        placements=placements,
        reasons=(),
        search=Search(8, 1, 1, 0.0),
        verification=Verification(0.0, 0.0, 0.0, True),
    )


class FakeExecutor:
    """Answers with a made-up layout, or as it is told to."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.failure: SolveFailed | None = None
        self.ended_by = "answer"
        self.unwell: SolveFailed | None = None
        self.limits: list[tuple[float, float]] = []
        self.given: list[bytes | str] = []
        self.running = 0
        self.most_running = 0
        self.error: Exception | None = None
        self.deaths: list[Exception] = []  # raised one by one before anything else happens

    def start(self) -> None:
        self.stopped = False

    async def ready(self) -> None:
        pass

    async def solve(self, task: Task, report: Report) -> Answer:
        report("stage", '{"what": "made up", "done": 0.0}')
        self.given.append(task.request)
        request, _ = request_of(LayoutRequest, task.request)
        return await self._answer(request, task.request_hash, task.time_limit, task.stop_after)

    async def evaluate(self, request: bytes | str, request_hash: str, stop_after: float) -> Answer:
        asked, _ = request_of(EvaluateRequest, request)
        return await self._answer(asked, request_hash, 0.0, stop_after)

    async def _answer(self, request: LayoutRequest, request_hash: str, time_limit: float, stop_after: float) -> Answer:
        self.limits.append((time_limit, stop_after))
        self.running += 1
        self.most_running = max(self.most_running, self.running)
        try:
            await asyncio.sleep(self.seconds)
        finally:
            self.running -= 1
        if self.deaths:
            raise self.deaths.pop()
        if self.error is not None:
            raise self.error
        if self.failure is not None:
            raise self.failure
        result = result_document(made_up_layout(request), request_hash)
        return Answer(
            json.dumps(result), result["outcome"], result["objective"], result["version"], ended_by=self.ended_by
        )

    async def self_test(self) -> None:
        if self.unwell is not None:
            raise self.unwell

    def alive(self) -> int:
        return 1

    async def stop(self) -> None:
        self.stopped = True


@pytest.fixture
def example() -> dict[str, Any]:
    """A valid request, free to be spoiled."""
    request = copy.deepcopy(EXAMPLE)
    request["certificate"] = None
    return request


@pytest.fixture
def fake() -> FakeExecutor:
    return FakeExecutor()


@pytest.fixture
def client_with(fake: FakeExecutor, tmp_path: Path) -> Iterator[Callable[..., TestClient]]:
    """Makes clients of services with given settings on the fake executor; they keep their files in ``tmp_path``."""
    clients: list[TestClient] = []

    def make(**given: Any) -> TestClient:
        chosen: dict[str, Any] = {"data_dir": tmp_path, "drain": 0.0} | given
        settings = Settings(**chosen)
        client = TestClient(create_app(settings, fake), raise_server_exceptions=False)
        client.__enter__()
        clients.append(client)
        return client

    yield make
    for client in clients:
        client.__exit__(None, None, None)


@pytest.fixture
def client(client_with: Callable[..., TestClient]) -> TestClient:
    """A service on the fake executor."""
    return client_with(workers=2)


@pytest.fixture(scope="session")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """A service with real workers."""
    settings = Settings(workers=1, time_limit=30.0, data_dir=tmp_path_factory.mktemp("live"))
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        yield client
