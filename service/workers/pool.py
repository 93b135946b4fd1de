"""Warm worker processes of our own: the executor that is used unless another one is given."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from duocell.service.observability import metrics
from duocell.service.workers import fork_server, worker
from duocell.service.workers.answer import KNOWN, TIME_LIMIT, Answer
from duocell.service.workers.executor import Report, SolveFailed, Task, WorkerDied
from duocell.service.workers.worker_process import WorkerProcess

log = logging.getLogger(__name__)

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Threads gain nothing in IPOPT with MUMPS and would fight over the cores; processes do the parallel work."""
GRACE = 0.7
"""s between telling a solve to stop and killing its process."""
WARM_WITHIN = 60.0
"""s for a worker to start; also how long a solve waits for one."""
FIRST_PAUSE, LONGEST_PAUSE = 0.05, 5.0
"""s between attempts to start a worker while they fail."""


class ProcessExecutor:
    """Processes that are warmed up and kept.

    There is one process more than solves at the same time: it takes the self-tests and the evaluations, and stands in
    at once for a worker that died until another one is there. Keeping the number of solves down is the caller's part.
    ``data_dir`` is where they find the robots and meshes that users brought.

    Attributes:
        workers: processes, warm or not yet.
        deaths: workers that ended in the middle of something, or while they waited; those killed by `GRACE` as well.
    """

    def __init__(
        self, workers: int, data_dir: Path | None = None, *, solve: Callable[..., Answer] = worker.solve
    ) -> None:
        self._data_dir = None if data_dir is None else data_dir.absolute()
        self._size = workers + 1
        self._solve = solve
        # The one used last is used next: its caches fit best.
        self._idle: asyncio.LifoQueue[WorkerProcess] = asyncio.LifoQueue()
        self._busy: set[WorkerProcess] = set()
        self.workers: set[WorkerProcess] = set()
        self._warm: set[WorkerProcess] = set()
        self._ready = asyncio.Event()
        self._places: list[asyncio.Task[None]] = []
        self.deaths = 0

    def start(self) -> None:
        """See `Executor`."""
        if self._places:
            return
        limit_threads()
        fork_server.warm_up()
        with contextlib.suppress(RuntimeError):  # no event loop yet: the engines are loaded meanwhile
            loop = asyncio.get_running_loop()
            self._places = [loop.create_task(self._keep()) for _ in range(self._size)]

    async def ready(self) -> None:
        """See `Executor`."""
        self.start()
        await self._ready.wait()

    async def solve(self, task: Task, report: Report) -> Answer:
        """See `Executor`."""
        arguments = task.request, task.request_hash, task.time_limit, self._data_dir
        return await self._run(self._solve, arguments, task.stop_after, report)

    async def evaluate(self, request: bytes | str, request_hash: str, stop_after: float) -> Answer:
        """See `Executor`."""
        arguments = request, request_hash, self._data_dir
        return await self._run(worker.evaluate, arguments, stop_after, lambda kind, data: None)

    async def self_test(self) -> None:
        """See `Executor`."""
        for _ in range(self._size + 1):
            with contextlib.suppress(WorkerDied):  # perhaps long ago, with nobody noticing
                await self._run(worker.self_test, (), worker.SELF_TEST_LIMIT * 2.0, lambda kind, data: None)
                return
        raise SolveFailed("worker-died", "One worker after the other ended in the self-test.")

    def alive(self) -> int:
        """See `Executor`."""
        return len(self._warm)

    def busy(self) -> set[WorkerProcess]:
        """Workers that do something."""
        return self._warm & self._busy

    async def stop(self) -> None:
        """See `Executor`."""
        for place in self._places:
            place.cancel()
        await asyncio.gather(*self._places, return_exceptions=True)
        self._places.clear()
        for one in self.workers:
            one.kill()
        await asyncio.gather(*(one.ended for one in self.workers))
        for collection in (self.workers, self._warm, self._busy):
            collection.clear()
        self._idle = asyncio.LifoQueue()

    # ----------------------------------------------------------------------------------------------------- the workers

    async def _keep(self) -> None:
        """See to it that one place of the pool has a worker, for ever."""
        pause = FIRST_PAUSE
        while True:
            try:
                one = await self._started()
            except Exception as error:  # whatever keeps a worker from starting, the next one may start
                self.workers = {one for one in self.workers if one.alive}
                log.error("a worker did not start: %r", error)
                await asyncio.sleep(pause)
                pause = min(2.0 * pause, LONGEST_PAUSE)
                continue
            pause = FIRST_PAUSE
            self._put_back(one)
            exit_code = await asyncio.shield(one.ended)
            self.deaths += 1
            metrics.worker_died(exit_code)
            self._warm.discard(one)
            if not self._warm:
                self._ready.clear()
            self.workers.discard(one)
            log.warning("worker %s ended with code %s; another one takes its place", one.pid, exit_code)

    async def _started(self) -> WorkerProcess:
        """A warm worker."""
        one = await WorkerProcess.start()
        self.workers.add(one)
        try:
            async with asyncio.timeout(WARM_WITHIN):
                answer = await one.warm()
            if answer.text is None:
                raise SolveFailed(answer.code, answer.detail)
        except BaseException:
            one.kill()
            raise
        self._warm.add(one)
        self._ready.set()
        return one

    async def _take(self) -> WorkerProcess:
        """A warm worker that does nothing at the moment."""
        self.start()
        try:
            async with asyncio.timeout(WARM_WITHIN):
                while not (one := await self._idle.get()).alive:
                    pass  # it died while it waited
        except TimeoutError as error:
            raise SolveFailed("no-worker", "No worker could be started. See the log of the server.") from error
        self._busy.add(one)
        return one

    def _put_back(self, one: WorkerProcess) -> None:
        """A worker can be used (again), if it lives."""
        self._busy.discard(one)
        if one.alive:
            self._idle.put_nowait(one)

    # -------------------------------------------------------------------------------------------------------- the runs

    async def _run(
        self, function: Callable[..., Answer], arguments: tuple[Any, ...], stop_after: float, report: Report
    ) -> Answer:
        """Call a function of `duocell.service.workers.worker` in a worker."""
        one = await self._take()
        cancelled = asyncio.Event()
        known = _Known(report)
        reply = one.begin(function, arguments, known)
        # A task of its own, so that nothing can come between a solve that is stopped and its worker's return.
        run = asyncio.create_task(self._see_through(one, reply, known, cancelled, stop_after))
        try:
            return await asyncio.shield(run)
        except asyncio.CancelledError:
            cancelled.set()
            with contextlib.suppress(SolveFailed):
                await asyncio.shield(run)
            raise

    async def _see_through(
        self,
        one: WorkerProcess,
        reply: asyncio.Future[Answer],
        known: _Known,
        cancelled: asyncio.Event,
        stop_after: float,
    ) -> Answer:
        """Wait for the answer of a run; ask it to stop, and kill its worker, where that takes too long.

        What is known then is the answer.
        """
        called_off = asyncio.create_task(cancelled.wait())
        try:
            either: list[asyncio.Future[Any]] = [reply, called_off]
            await asyncio.wait(either, timeout=stop_after, return_when=asyncio.FIRST_COMPLETED)
            too_late = f"No answer within {stop_after:g} s; the solve was stopped."
            killed = False
            if not reply.done():
                one.ask_to_stop()
                await asyncio.wait({reply}, timeout=GRACE)
                if not reply.done():
                    killed = True
                    one.kill()
                    await one.ended
            answer = Answer(None, code=worker.STOPPED) if killed else reply.result()
        finally:
            called_off.cancel()
            self._put_back(one)
        if answer.text is None and answer.code == worker.STOPPED:
            if known.answer is None or cancelled.is_set():
                raise SolveFailed(TIME_LIMIT, too_late)
            return known.answer._replace(ended_by=TIME_LIMIT)
        if answer.text is None:
            raise SolveFailed(answer.code, answer.detail)
        return answer


class _Known:
    """Passes on what a run tells, and keeps the best answer that it has told of."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self.answer: Answer | None = None

    def __call__(self, kind: str, data: str) -> None:
        if kind == KNOWN:
            self.answer = Answer(*json.loads(data))
        else:
            self._report(kind, data)


def limit_threads() -> None:
    """One thread per engine, in processes that load them from now on: this one and those it spawns."""
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
