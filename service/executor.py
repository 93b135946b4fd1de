"""Where solves run: a seam, and a pool of warm processes behind it."""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import os
import signal
import threading
from concurrent.futures import BrokenExecutor
from pathlib import Path
from typing import Any, Protocol

from pebble import ProcessExpired, ProcessPool

from service import worker
from service.worker import Answer

log = logging.getLogger(__name__)

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Threads gain nothing in IPOPT with MUMPS and would fight over the cores; processes do the parallel work."""

PRELOAD = "service.preload"

ATTEMPTS = 3
"""Pools that a task may be handed to; only tasks that no worker had begun are handed on."""


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


class Executor(Protocol):
    """Where solves run."""

    def start(self) -> None:
        """Begin to warm up; returns at once."""

    async def solve(self, text: str, request_hash: str, time_limit: float, kill_after: float) -> Answer:
        """The result of an accepted request; its text is never None.

        Args:
            text: the request.
            request_hash: of that request.
            time_limit: s, soft limit.
            kill_after: s, hard limit.

        Raises:
            SolveFailed: there is none, and why.
        """

    async def evaluate(self, text: str, request_hash: str, kill_after: float) -> Answer:
        """The result of an accepted request to evaluate a layout; arguments and errors as for `solve`."""

    async def self_test(self) -> None:
        """Solve a small cell with a known answer.

        Raises:
            SolveFailed: it came out wrong or not at all.
        """

    def alive(self) -> int:
        """Workers that live."""

    def stop(self) -> None:
        """End all workers; blocks until they are gone."""


class ProcessExecutor:
    """Processes that are warmed up and kept.

    They are forked from a server process of `multiprocessing` that has no threads and has loaded the engines
    (`service.preload`), never from this process with its threads.

    There is one process more than solves at the same time: it takes the self-tests and the evaluations, and stands in
    at once for a worker that died until another one is there. Keeping the number of solves down is the caller's part.
    ``data_dir`` is where they find the robots and meshes that users brought.
    """

    def __init__(self, workers: int, data_dir: Path | None = None, *, solve: Any = worker.solve) -> None:
        self._workers = workers
        self._data_dir = None if data_dir is None else data_dir.absolute()
        self._solve = solve
        self._pool: ProcessPool | None = None
        self._starting: threading.Thread | None = None

    def start(self) -> None:
        """Start the processes; returns before they are there."""
        if self._pool is None:
            limit_threads()
            context = multiprocessing.get_context("forkserver")
            context.set_forkserver_preload([PRELOAD])
            self._pool = ProcessPool(max_workers=self._workers + 1, initializer=worker.initialize, context=context)
            self._starting = threading.Thread(target=_begin, args=(self._pool,), name="start-workers", daemon=True)
            self._starting.start()

    async def solve(self, text: str, request_hash: str, time_limit: float, kill_after: float) -> Answer:
        """See `Executor`."""
        return await self._run(self._solve, (text, request_hash, time_limit, self._data_dir), kill_after)

    async def evaluate(self, text: str, request_hash: str, kill_after: float) -> Answer:
        """See `Executor`."""
        return await self._run(worker.evaluate, (text, request_hash, self._data_dir), kill_after)

    async def self_test(self) -> None:
        """See `Executor`."""
        await self._run(worker.self_test, (), worker.SELF_TEST_LIMIT * 2.0)

    def alive(self) -> int:
        """See `Executor`."""
        return 0 if self._pool is None else len(multiprocessing.active_children())

    def stop(self) -> None:
        """See `Executor`."""
        pool, self._pool = self._pool, None
        if pool is not None:
            self._join_start()
            _end(pool)

    async def _run(self, function: Any, arguments: tuple[Any, ...], kill_after: float) -> Answer:
        """Run a function of `service.worker`, on another pool if this one breaks before the function began."""
        for _ in range(ATTEMPTS):
            self.start()
            pool = self._pool
            if pool is None:
                break
            await asyncio.to_thread(self._join_start)
            try:
                answer: Answer = await asyncio.wrap_future(pool.schedule(function, arguments, timeout=kill_after))
            except TimeoutError as error:
                raise SolveFailed(
                    "time-limit", f"No answer within {kill_after:g} s; the worker was stopped."
                ) from error
            except ProcessExpired as error:
                raise SolveFailed("worker-died", _obituary(error.exitcode)) from error
            except (BrokenExecutor, RuntimeError) as error:
                log.warning("the pool of workers broke (%s); starting another", error)
                await self._discard(pool)
                continue
            if answer.text is None:
                raise SolveFailed(answer.code, answer.detail)
            return answer
        raise SolveFailed("no-worker", "No worker could be started. See the log of the server.")

    def _join_start(self) -> None:
        """Wait until the processes are started; they need not be warm yet."""
        if self._starting is not None:
            self._starting.join()

    async def _discard(self, pool: ProcessPool) -> None:
        """Replace a broken pool, once, whoever notices it first."""
        if self._pool is pool:
            self._pool = None
            await asyncio.to_thread(_end, pool)


def limit_threads() -> None:
    """One thread per engine, in processes that load them from now on: this one and those it spawns."""
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")


def _begin(pool: ProcessPool) -> None:
    """Start the processes of a pool; blocks until the engines are loaded."""
    if not pool.active:  # asking starts them
        log.error("the pool of workers did not start")


def _end(pool: ProcessPool) -> None:
    """Stop a pool; blocks."""
    pool.stop()  # type: ignore[no-untyped-call]
    pool.join()


def _obituary(exit_code: int) -> str:
    """How a process ended, in words."""
    end = f"exit code {exit_code}" if exit_code >= 0 else f"signal {signal.Signals(-exit_code).name}"
    return (
        f"The worker process was ended by {end} in the middle of the solve. Another one has taken its place; try again."
    )
