"""Keeps hold of the store, and sees to it that every job in it is somebody's."""

from __future__ import annotations

import asyncio
import logging

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.active import Active
from duocell.service.jobs.dispatcher import Dispatcher
from duocell.service.jobs.event_log import LAST, EventLog
from duocell.service.jobs.job import Ending, Failure, Job, JobStatus
from duocell.service.jobs.job_store import LeaseLost
from duocell.service.jobs.store_threads import StoreThreads

log = logging.getLogger(__name__)

CHECK_EVERY, OPEN_EVERY = 2.0, 1.0
"""s between looks at the store while it works, and while it does not."""


class StoreWatch:
    """Opens the store, looks at it again and again, and takes up jobs that nobody has.

    Nobody has them when a server died, when its lease went to another one, or when an answer of the database was lost
    after the change that it confirmed.

    Args:
        store: the store. dispatcher: has jobs carried out. max_attempts: of a job.
        on_the_way: identifiers of jobs that are being taken in at this moment.
    """

    def __init__(self, store: StoreThreads, dispatcher: Dispatcher, max_attempts: int, on_the_way: set[str]) -> None:
        self._store = store
        self._dispatcher = dispatcher
        self._max_attempts = max_attempts
        self._on_the_way = on_the_way
        self._open = False
        self.tried = asyncio.Event()
        """Set when the store was looked at for the first time."""

    async def run(self) -> None:
        """Watch until cancelled."""
        while True:
            self._store.troubled.clear()
            try:
                await self._look()
                self._store.problem = ""
            except StoreUnavailable as error:
                if error.detail != self._store.problem or not self.tried.is_set():
                    log.warning("the store is not available: %s", error.detail)
                self._store.problem = error.detail
                if isinstance(error, LeaseLost):
                    self._open = False
                    self._dispatcher.abandon()
            self.tried.set()
            await self._pause()

    async def _pause(self) -> None:
        """Until the next look; a failure that somebody meets while all seemed well is looked at at once."""
        if self._store.problem:
            await asyncio.sleep(OPEN_EVERY)
            return
        try:
            async with asyncio.timeout(CHECK_EVERY):
                await self._store.troubled.wait()
        except TimeoutError:
            pass

    async def _look(self) -> None:
        store = self._store.store
        if not self._open:
            await self._store.supervise(store.open)
            self._open = True
        await self._store.supervise(store.check)
        known = self._known()
        found = await self._store.read(store.unfinished)
        known |= self._known()
        for job in found:
            if job.id not in known:
                await self._adopt(job)

    def _known(self) -> set[str]:
        """Jobs that are somebody's here."""
        return self._on_the_way | set(self._dispatcher.active)

    async def _adopt(self, job: Job) -> None:
        """Have a job carried out that nobody has: what ran waits again."""
        waits: Job | None = job
        if job.status is JobStatus.RUNNING:
            waits = await self._store.supervise(lambda: self._interrupted(job))
        if waits is not None:
            self._dispatcher.queue(Active(waits))

    def _interrupted(self, job: Job) -> Job | None:
        """Put a job back that ran when a process ended; None if that has happened too often."""
        most, number, store = self._max_attempts, job.attempts, self._store.store
        if job.owner == store.owner:  # stored as running here, without anybody being told
            event = EventLog().state(job.revision + 1, "status", status="queued", detail="It is taken up again.")
            return store.put_back(job, [event], counted=False)
        detail = f"The service ended in the middle of attempt {number} of {most}."
        if number < most:
            event = EventLog().state(job.revision + 1, "status", status="queued", detail=detail)
            return store.put_back(job, [event], counted=True)
        error = {"code": "interrupted", "detail": detail}
        ending = Ending(JobStatus.FAILED, failure=Failure(**error))
        event = EventLog().state(job.revision + 1, LAST, status="failed", error=error, ended=ending.ended)
        store.finish(job, ending, [event])
        return None
