"""Jobs under way: who is next, who runs, what becomes of them."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import deque
from collections.abc import Callable
from contextvars import Context
from dataclasses import replace
from math import ceil
from typing import Any

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.active import ENDED, Active, Rules
from duocell.service.jobs.event_log import LAST
from duocell.service.jobs.fair_queue import FairQueue
from duocell.service.jobs.job import Ending, Failure, Job, JobEvent, JobStatus
from duocell.service.jobs.job_store import LeaseLost
from duocell.service.jobs.store_threads import StoreThreads
from duocell.service.observability import logs, metrics, telemetry
from duocell.service.requests.prepared import is_prepared
from duocell.service.workers.executor import Executor, SolveFailed, Task, WorkerDied

log = logging.getLogger(__name__)

FIRST_PAUSE, LONGEST_PAUSE = 0.1, 2.0
"""s between attempts to store something while the store is not available."""


class Dispatcher:
    """Takes jobs that are stored, has them solved in turn, and stores what comes out.

    Lives in the event loop.
    """

    def __init__(self, store: StoreThreads, executor: Executor, rules: Rules) -> None:
        self._store = store
        self._executor = executor
        self._rules = rules
        self._waiting = FairQueue()
        self._free = rules.workers
        self._tasks: set[asyncio.Task[None]] = set()
        self._draining = False
        self._seconds: deque[float] = deque([1.0], maxlen=20)  # how long the last solves took
        self.active: dict[str, Active] = {}
        self.ended = 0
        """Jobs that came to an end here."""

    # ------------------------------------------------------------------------------------------------ coming and going

    @property
    def running(self) -> int:
        """Jobs being solved."""
        return len(self._tasks)

    @property
    def waiting(self) -> int:
        """Jobs that wait for a worker."""
        return len(self._waiting)

    def waiting_of(self, client: str) -> int:
        """Jobs of a client that wait for a worker."""
        return self._waiting.of(client)

    def retry_after(self) -> int:
        """s after which there is probably room in the queue."""
        mean = sum(self._seconds) / len(self._seconds)
        return min(60, ceil(mean * max(1, self.waiting) / self._rules.workers))

    def reserve(self) -> bool:
        """Keep a worker for a job that is about to come, if one is free and nobody waits."""
        if self._draining or self._waiting or self._free <= 0 or not self._executor.alive():
            return False
        self._free -= 1
        return True

    def release(self) -> None:
        """A worker is free (again)."""
        self._free += 1
        self._pump()

    def run(self, active: Active) -> None:
        """Carry out a job that is stored as running, with the worker reserved for it."""
        self.active[active.job.id] = active
        self._start(active)

    def queue(self, active: Active, *, first: bool = False) -> None:
        """Carry out a job that is stored as queued, when its turn comes."""
        self.active[active.job.id] = active
        (self._waiting.add_first if first else self._waiting.add)(active.job.client, active.job.id)
        self._pump()

    def end(self, active: Active, job: Job, *events: JobEvent) -> None:
        """A job is stored as finished: tell everybody."""
        self.active.pop(job.id, None)
        self._waiting.remove(job.client, job.id)
        self.ended += 1
        _count(job)
        active.job = job
        active.event_log.tell(*events)
        active.event_log.close()
        if not active.finished.done():
            active.finished.set_result(job)

    def abandon(self) -> None:
        """Let go of everything: another server owns the store and has these jobs carried out."""
        for active in list(self.active.values()):
            del self.active[active.job.id]
            active.call_off()
            active.give_up()
        self._waiting = FairQueue()

    async def drain(self, seconds: float) -> None:
        """Begin nothing more, let running solves finish within a time, put the others back into the queue."""
        self._draining = True
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=seconds)
        for active in self.active.values():
            active.call_off()
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=FIRST_PAUSE + 2.0)
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for active in self.active.values():
            active.give_up()

    # ------------------------------------------------------------------------------------------------ the way of a job

    def _pump(self) -> None:
        while not self._draining and self._free > 0 and self._waiting:
            self._free -= 1
            self._start(self.active[self._waiting.next()])

    def _start(self, active: Active) -> None:
        active.called_off = active.called_off or self._draining
        # In a context of its own: the request or job that made room has nothing to do with this one.
        task = asyncio.create_task(self._observed(active), name=f"job {active.job.id}", context=Context())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _observed(self, active: Active) -> None:
        """`_carry_out`, under its name in logs and traces."""
        with logs.about(job_id=active.job.id), telemetry.solving(active.job.id):
            await self._carry_out(active)

    async def _carry_out(self, active: Active) -> None:
        """One attempt, and what follows from it."""
        kept = False
        try:
            try:
                ending = await self._attempt(active)
            finally:
                self.release()
            if ending is not None:
                again = ending.status is JobStatus.QUEUED
                kept = await (self._again if again else self._finish)(active, ending)
        except LeaseLost:
            log.warning("job %s belongs to another server now", active.job.id)
        except Exception:  # nobody else would tell of it
            log.exception("job %s", active.job.id)
        if not kept:
            self._forget(active)

    async def _attempt(self, active: Active) -> Ending | None:
        """Solve; how it ended, "queued" for another attempt, or None if somebody else has ended the job."""
        if active.job.status is JobStatus.QUEUED:
            await self._executor.ready()  # waiting for a worker to start is no attempt
            job = active.job
            event = active.event_log.state(job.revision + 1, "status", status="running", attempt=job.attempts + 1)
            claimed = await self._stored(job, JobStatus.RUNNING, self._store.store.claim, job.id, [event])
            if claimed is None:
                return None
            active.job = claimed
            active.event_log.saved(event.number)
            active.event_log.tell(event)
        try:
            return await self._solve(active)
        except WorkerDied as error:
            last = active.job.attempts >= self._rules.max_attempts
            detail = f"{error.detail} It was attempt {active.job.attempts} of {self._rules.max_attempts}."
            return Ending(JobStatus.FAILED if last else JobStatus.QUEUED, failure=Failure(error.code, detail))
        except SolveFailed as error:
            return Ending(JobStatus.FAILED, failure=Failure(error.code, error.detail))
        except asyncio.CancelledError:
            if not active.called_off:
                raise
            # Cancelled jobs are final in the store already; others go back into the queue.
            return Ending(JobStatus.QUEUED) if active.job.id in self.active else None
        except Exception:  # whatever happens, a job comes to an end
            log.exception("job %s", active.job.id)
            return Ending(JobStatus.FAILED, failure=Failure("internal", "Unexpected error; see the log of the server."))

    async def _solve(self, active: Active) -> Ending:
        job, rules = active.job, self._rules
        limit = rules.time_limit if job.time_limit is None else job.time_limit
        most = (limit + job.certificate_time) * job.runs + rules.grace  # every run has its own limit
        request = job.prepared if job.prepared is not None and is_prepared(job.prepared) else job.request
        task = Task(request, job.request_hash, limit, most)

        def note(kind: str, data: str) -> None:
            metrics.reported(kind, data)
            active.event_log.note(kind, data)

        active.solving = asyncio.create_task(self._executor.solve(task, note))
        if active.called_off:
            active.solving.cancel()
        began = time.monotonic()
        try:
            answer = await active.solving
        finally:
            active.solving = None
        self._seconds.append(time.monotonic() - began)
        ended = ENDED[answer.ended_by].format(limit=limit)
        return Ending(
            JobStatus.SUCCEEDED,
            answer.text,
            answer.outcome,
            answer.objective,
            answer.version,
            ended_by=answer.ended_by,
            detail=ended,
        )

    async def _again(self, active: Active, why: Ending) -> bool:
        """Back into the queue: before all others if its worker died, for another process if this one ends.

        False if the job is none of ours any more.
        """
        job, died = active.job, why.failure
        reason = "The service was stopped." if died is None else died.detail
        event = active.event_log.state(job.revision + 1, "status", status="queued", detail=reason)
        events = [*active.event_log.unsaved(), event]
        put_back = self._store.store.put_back
        back = await self._stored(job, JobStatus.QUEUED, put_back, job, events, counted=died is not None)
        if back is not None:
            active.job, active.called_off = back, False
            active.event_log.saved(event.number)
            active.event_log.tell(event)
            if not self._draining:
                self.queue(active, first=True)
        return back is not None

    async def _finish(self, active: Active, ending: Ending) -> bool:
        """Store a final state. False if the job is none of ours any more."""
        job, failure = active.job, ending.failure
        event = active.event_log.state(
            job.revision + 1,
            LAST,
            status=ending.status.value,
            outcome=ending.outcome,
            objective=ending.objective,
            error=None if failure is None else {"code": failure.code, "detail": failure.detail},
            ended=ending.ended,
        )
        events = [*active.event_log.unsaved(), event]
        head = await self._stored(job, ending.status, self._store.store.finish, job, ending, events)
        if head is not None:
            self.end(active, replace(head, request=job.request, result=ending.result), event)
        return head is not None

    def _forget(self, active: Active) -> None:
        """Somebody else has ended the job or taken it over; who waits for it must look into the store."""
        if self.active.pop(active.job.id, None) is not None:
            log.warning("job %s was changed by somebody else", active.job.id)
        active.give_up()

    async def _stored(
        self, job: Job, wanted: JobStatus, function: Callable[..., Job | None], *arguments: Any, **named: Any
    ) -> Job | None:
        """Change a job in the store, again and again while that is not available; None if somebody else has changed it.

        A change whose answer was lost has been made perhaps, and then cannot be made again: it is looked for.

        Raises:
            LeaseLost: the store belongs to another server.
        """
        pause, doubt = FIRST_PAUSE, False
        while True:
            try:
                changed = await self._store.change(function, *arguments, **named)
                if changed is None and doubt:
                    found = await self._store.read(self._store.store.get, job.id)
                    changed = found if found is not None and self._is_ours(found, job, wanted) else None
                return changed
            except LeaseLost:
                raise
            except StoreUnavailable as error:
                log.warning("%s: trying again in %.1f s", error.detail, pause)
                doubt = True
                await asyncio.sleep(pause)
                pause = min(2.0 * pause, LONGEST_PAUSE)

    def _is_ours(self, found: Job, before: Job, wanted: JobStatus) -> bool:
        """Whether a job is what a change of ours has made of it."""
        owner = None if wanted is JobStatus.QUEUED else self._store.store.owner
        return found.status is wanted and found.revision == before.revision + 1 and found.owner == owner


def _count(job: Job) -> None:
    """Metrics and a line in the log for a job that came to an end."""
    how = job.outcome or (job.status.value if job.failure is None else job.failure.code)
    facts: dict[str, Any] = {"job_id": job.id, "status": job.status.value, "outcome": how}
    if job.started_at is not None and job.finished_at is not None:
        facts["seconds"] = max(0.0, (job.finished_at - job.started_at).total_seconds())  # clocks can be set back
        metrics.job_finished(how, facts["seconds"])
    log.info("job ended", extra=facts)
