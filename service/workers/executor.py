"""Where solves run: a seam. `duocell.service.workers.pool` is what stands behind it by default."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from duocell.service.workers.answer import Answer

Report = Callable[[str, str], None]
"""Told kind and JSON data of every event of a solve."""


@dataclass(frozen=True, slots=True)
class Task:
    """What is to be solved.

    Attributes:
        request: an accepted one, as its form (`duocell.service.requests.prepared`) or its JSON. request_hash: of it.
        time_limit: s, soft limit of one run of the optimizer where the request has none; it then answers with the best
            it has. The time of a certificate comes on top.
        stop_after: s after which the solve is told to stop, and killed if it does not.
    """

    request: bytes | str
    request_hash: str
    time_limit: float
    stop_after: float


class SolveFailed(Exception):
    """A solve without an answer.

    Attributes:
        code: stable name of the failure.
        detail: sentence about it.
    """

    def __init__(self, code: str, detail: str) -> None:
        super().__init__(detail)
        self.code = code
        self.detail = detail


class WorkerDied(SolveFailed):
    """The process was ended in the middle of the solve: it may be worth another try."""

    def __init__(self, detail: str) -> None:
        super().__init__("worker-died", detail)


class Executor(Protocol):
    """Where solves run."""

    def start(self) -> None:
        """Begin to warm up; returns at once. May be called before there is an event loop, and again when there is."""

    async def ready(self) -> None:
        """Return when there is a worker that can solve, however long that takes."""

    async def solve(self, task: Task, report: Report) -> Answer:
        """The result of an accepted request; its text is never None.

        Cancelling the call stops the solve: when `asyncio.CancelledError` comes out, its place is free again, less
        than a second later.

        Args:
            task: what to solve.
            report: told what happens meanwhile, in this thread; everything before this returns.

        Raises:
            WorkerDied: the process it ran in is gone. Other solves are not affected.
            SolveFailed: there is no answer, and why.
        """

    async def evaluate(self, request: bytes | str, request_hash: str, stop_after: float) -> Answer:
        """The result of an accepted request to evaluate a layout; arguments and errors as for `solve`."""

    async def self_test(self) -> None:
        """Solve a small cell with a known answer.

        Raises:
            SolveFailed: it came out wrong or not at all.
        """

    def alive(self) -> int:
        """Workers that can solve."""

    async def stop(self) -> None:
        """End all workers; returns when they are gone."""
