"""Where requests are read and checked: small ones in a thread, the others in a process that can be ended.

A large body keeps an interpreter busy for a second, and nobody else would be answered meanwhile; a thread cannot be
ended, a process can. Small bodies cannot ask for much, and the way to another process would take them longer.
"""

from __future__ import annotations

import asyncio
import logging
import signal

from fastapi.concurrency import run_in_threadpool

from duocell.service.common.problems import Problem
from duocell.service.library.document_stores import View
from duocell.service.requests.accept import Accepted
from duocell.service.requests.reading import Read, Reader, read_evaluation, read_layout, read_within
from duocell.service.settings import Limits, Settings
from duocell.service.workers.executor import WorkerDied
from duocell.service.workers.worker_process import WorkerProcess

log = logging.getLogger(__name__)

SMALL = 16_384
"""Bytes of a body that is read in this process, if it names no mesh: some milliseconds of the interpreter."""
PROCESSES = 2
"""That read at the same time."""
MOST_PRESENT = 64
"""Large bodies at the same time, waiting ones included."""
FORGET = 1_000_000
"""Bytes of a body after which a process is not used again: its memory would never come back."""
WAITING_COUNTS = 6.0
"""A process is also ended after so many times the limit of its own time, whatever it waits for."""
RETRY_AFTER = "5"


class Acceptance:
    """Reads and checks requests; lives in the event loop."""

    def __init__(self, settings: Settings) -> None:
        """Nothing is started: a process is, with the first large body."""
        self._limits = Limits(**settings.model_dump())
        self._data_dir = settings.data_dir.absolute()
        self._within = settings.accept_limit
        self._present = 0
        self._places = asyncio.Semaphore(PROCESSES)
        self._here = asyncio.Semaphore(1)  # more threads would only wait for each other, and the event loop for all
        self._processes: set[WorkerProcess] = set()
        self._idle: list[WorkerProcess] = []

    async def layout(self, body: bytes, view: View | None = None) -> Accepted:
        """The request for a layout in a body.

        Args:
            body: a JSON document.
            view: what of robots and meshes the sender sees; None: all there are.

        Raises:
            NotJson, InvalidRequest: it is none, or cannot be carried out.
            Problem: it takes too long, or nobody could read it.
        """
        return (await self._read(read_layout, body, view)).request()

    async def evaluation(self, body: bytes, view: View | None = None) -> Accepted:
        """The request to evaluate a layout in a body; errors as for `layout`."""
        return (await self._read(read_evaluation, body, view)).request()

    async def stop(self) -> None:
        """End all processes; returns when they are gone."""
        for one in self._processes:
            one.kill()
        await asyncio.gather(*(one.ended for one in self._processes))
        self._processes.clear()
        self._idle.clear()

    async def _read(self, reader: Reader, body: bytes, view: View | None) -> Read:
        view = view or View(self._data_dir)
        if len(body) <= SMALL and b"mesh" not in body and b"\\u" not in body:
            async with self._here:
                return await run_in_threadpool(reader, body, self._limits, view)
        if self._present >= MOST_PRESENT:
            raise _failed(f"{self._present} large requests are being read.")
        self._present += 1
        try:
            async with self._places:
                return await self._read_elsewhere(reader, body, view)
        finally:
            self._present -= 1

    async def _read_elsewhere(self, reader: Reader, body: bytes, view: View) -> Read:
        """In a process."""
        try:
            async with asyncio.timeout(WAITING_COUNTS * self._within):
                return await self._run(await self._taken(), reader, body, view)
        except TimeoutError as error:
            raise self._too_long() from error
        except (WorkerDied, OSError, EOFError) as error:
            log.error("a process that reads requests ended: %r", error)
            raise _failed("The process that read the request ended.") from error

    async def _run(self, one: WorkerProcess, reader: Reader, body: bytes, view: View) -> Read:
        """The process is ended if it is not done when this is cancelled."""
        done = False
        try:
            arguments = reader, self._within, body, self._limits, view
            read = await one.begin(read_within, arguments, lambda kind, data: None)
            done = len(body) <= FORGET
        except WorkerDied as error:
            if await one.ended == -signal.SIGPROF:
                raise self._too_long() from error
            raise
        finally:
            if done:
                self._idle.append(one)
            else:
                one.kill()
        return read

    async def _taken(self) -> WorkerProcess:
        """A process that does nothing."""
        self._processes = {one for one in self._processes if one.alive}
        while self._idle:
            one = self._idle.pop()
            if one.alive:
                return one
        one = await WorkerProcess.start(tested=False)
        self._processes.add(one)
        try:
            await one.warm()
        except BaseException:
            one.kill()
            raise
        return one

    def _too_long(self) -> Problem:
        return _failed(f"Reading and checking it takes longer than {self._within:g} s (DUOCELL_ACCEPT_LIMIT).")


def _failed(detail: str) -> Problem:
    return Problem("acceptance-failed", f"{detail} Try again in {RETRY_AFTER} s.", headers={"Retry-After": RETRY_AFTER})
