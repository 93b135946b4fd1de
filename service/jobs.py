"""Jobs: a request on its way to a result.

`Jobs` is what the endpoints need; `MemoryJobs` keeps everything in this process and forgets it with the process.
"""

from __future__ import annotations

import asyncio
import logging
import time
import uuid
from collections import deque
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum
from math import ceil
from typing import Protocol

from service.accept import Accepted
from service.executor import Executor, SolveFailed

log = logging.getLogger(__name__)


class JobStatus(StrEnum):
    """Where a job is."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def finished(self) -> bool:
        """True if it will not change any more."""
        return self not in (JobStatus.QUEUED, JobStatus.RUNNING)


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a job failed: a stable code and a sentence."""

    code: str
    detail: str


@dataclass(frozen=True, slots=True)
class Job:
    """One state of a job; a change makes another object with a higher ``revision``.

    Attributes:
        request: JSON of the accepted request.
        result: JSON of the result once it succeeded.
        outcome: of the result.
        objective: of the result.
    """

    id: str
    name: str
    status: JobStatus
    created_at: datetime
    request: str
    revision: int = 1
    started_at: datetime | None = None
    finished_at: datetime | None = None
    result: str | None = None
    outcome: str | None = None
    objective: float | None = None
    failure: Failure | None = None

    @property
    def key(self) -> tuple[datetime, str]:
        """Place in the list; unique."""
        return self.created_at, self.id


class QueueFull(Exception):
    """No more jobs are taken in; ``retry_after`` [s] is when to try again."""

    def __init__(self, waiting: int, retry_after: int) -> None:
        super().__init__(f"{waiting} jobs are waiting")
        self.waiting = waiting
        self.retry_after = retry_after


class Jobs(Protocol):
    """Takes requests in, has them solved, keeps what came out. Every method may be called at any time."""

    async def submit(self, accepted: Accepted) -> Job:
        """Take a request in; it is solved without further calls.

        Raises:
            QueueFull: too many are waiting already; nothing was taken in.
        """

    async def get(self, job_id: str) -> Job | None:
        """The present state, or None if there is no such job (any more)."""

    async def newest(self, limit: int, after: tuple[datetime, str] | None = None) -> list[Job]:
        """At most ``limit`` jobs, the newest first, continuing behind the job with the key ``after``."""

    async def wait(self, job_id: str, timeout: float) -> Job | None:
        """The state of a job once it is finished, or after ``timeout`` s, whatever comes first."""

    async def reachable(self) -> bool:
        """Whether what keeps the jobs answers."""

    async def close(self) -> None:
        """Let go of everything that runs."""


class MemoryJobs:
    """Jobs in the memory of this process."""

    def __init__(
        self, executor: Executor, *, workers: int, time_limit: float, grace: float, max_queued: int, keep: int
    ) -> None:
        self._executor = executor
        self._workers = workers
        self._slots = asyncio.Semaphore(workers)
        self._time_limit = time_limit
        self._grace = grace
        self._max_queued = max_queued
        self._keep = keep
        self._jobs: dict[str, Job] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}  # of the jobs that are not finished
        self._finished: deque[str] = deque()
        self._seconds: deque[float] = deque([1.0], maxlen=20)  # how long the last solves took

    async def submit(self, accepted: Accepted) -> Job:
        """See `Jobs`."""
        waiting = len(self._tasks) - self._workers
        if waiting >= self._max_queued:
            mean = sum(self._seconds) / len(self._seconds)
            raise QueueFull(waiting, min(60, ceil(mean * max(1, waiting) / self._workers)))
        job = Job(
            id=uuid.uuid4().hex,
            name=accepted.name,
            status=JobStatus.QUEUED,
            created_at=datetime.now(UTC),
            request=accepted.text,
        )
        self._jobs[job.id] = job
        self._tasks[job.id] = asyncio.create_task(self._carry_out(job.id, accepted))
        return job

    async def get(self, job_id: str) -> Job | None:
        """See `Jobs`."""
        return self._jobs.get(job_id)

    async def newest(self, limit: int, after: tuple[datetime, str] | None = None) -> list[Job]:
        """See `Jobs`."""
        jobs = sorted(self._jobs.values(), key=lambda job: job.key, reverse=True)
        return [job for job in jobs if after is None or job.key < after][:limit]

    async def wait(self, job_id: str, timeout: float) -> Job | None:
        """See `Jobs`."""
        task = self._tasks.get(job_id)
        if task is not None:
            await asyncio.wait([task], timeout=timeout)
        return self._jobs.get(job_id)

    async def reachable(self) -> bool:
        """See `Jobs`; memory always answers."""
        return True

    async def close(self) -> None:
        """See `Jobs`."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _carry_out(self, job_id: str, accepted: Accepted) -> None:
        """The life of a job."""
        limit = self._time_limit + accepted.certificate_time
        kill_after = limit * accepted.runs + self._grace  # every run is given the limit anew
        try:
            async with self._slots:
                self._change(job_id, status=JobStatus.RUNNING, started_at=datetime.now(UTC))
                began = time.monotonic()
                answer = await self._executor.solve(accepted.text, accepted.request_hash, limit, kill_after)
                self._seconds.append(time.monotonic() - began)
            self._finish(
                job_id,
                JobStatus.SUCCEEDED,
                result=answer.text,
                outcome=answer.outcome,
                objective=answer.objective,
            )
        except SolveFailed as error:
            self._finish(job_id, JobStatus.FAILED, failure=Failure(error.code, error.detail))
        except asyncio.CancelledError:
            self._finish(job_id, JobStatus.CANCELLED, failure=Failure("cancelled", "The service was shut down."))
            raise
        except Exception:  # whatever happens, a job comes to an end
            log.exception("job %s", job_id)
            self._finish(
                job_id, JobStatus.FAILED, failure=Failure("internal", "Unexpected error; see the log of the server.")
            )

    def _change(self, job_id: str, **changes: object) -> None:
        job = self._jobs[job_id]
        self._jobs[job_id] = replace(job, revision=job.revision + 1, **changes)  # type: ignore[arg-type]

    def _finish(self, job_id: str, status: JobStatus, **changes: object) -> None:
        """Enter a final state and forget the oldest finished job if there are too many."""
        self._change(job_id, status=status, finished_at=datetime.now(UTC), **changes)
        del self._tasks[job_id]
        self._finished.append(job_id)
        if len(self._finished) > self._keep:
            del self._jobs[self._finished.popleft()]
