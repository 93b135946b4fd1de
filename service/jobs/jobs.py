"""Jobs: takes requests in, has them solved, keeps what came out. What the endpoints need, and nothing of HTTP."""

from __future__ import annotations

import asyncio
import uuid
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from duocell.service.common.job_errors import (
    AlreadyFinished,
    Closing,
    KeyBusy,
    KeyReused,
    NotFinished,
    QueueFull,
    StoreUnavailable,
)
from duocell.service.jobs.active import Active, Rules
from duocell.service.jobs.dispatcher import Dispatcher
from duocell.service.jobs.event_log import LAST
from duocell.service.jobs.job import CALLED_OFF, Job, JobEvent, JobStatus
from duocell.service.jobs.job_store import JobFilter, JobStore, KeyTaken, LeaseLost
from duocell.service.jobs.store_threads import StoreThreads
from duocell.service.jobs.store_watch import StoreWatch
from duocell.service.requests.accept import Accepted
from duocell.service.workers.executor import Executor

CHORES_EVERY = 1.0
"""s between the times when events are stored and old jobs forgotten."""
POLL_EVERY = 1.0
"""s between looks into the store for events of a job that another server carries out."""
EVENTS_AT_ONCE = 500
"""Events read from the store in one go."""


@dataclass(frozen=True, slots=True)
class Capacity:
    """How much is kept: jobs of a client and of all that may wait, finished jobs that are remembered."""

    max_queued: int
    max_queued_in_all: int
    keep: int


class Jobs:
    """Everything about jobs. Every method may be called at any time; any may raise `StoreUnavailable`."""

    def __init__(self, store: JobStore, executor: Executor, rules: Rules, capacity: Capacity) -> None:
        self._store = StoreThreads(store)
        self._dispatcher = Dispatcher(self._store, executor, rules)
        self._capacity = capacity
        self._accepting: set[tuple[str, str]] = set()
        self._storing: Counter[str] = Counter()  # jobs by client that are being stored, and will then wait
        self._on_the_way: set[str] = set()
        self._watch = StoreWatch(self._store, self._dispatcher, rules.max_attempts, self._on_the_way)
        self._background: list[asyncio.Task[None]] = []
        self._closing = False
        self._drained: asyncio.Task[None] | None = None

    # -------------------------------------------------------------------------------------------------------- its life

    @property
    def store_problem(self) -> str:
        """Why the store cannot be used at the moment; "" if it can."""
        return self._store.problem

    async def start(self) -> None:
        """Open the store and take up what is in it; where that does not work it is tried again in the background."""
        self._background = [asyncio.create_task(self._watch.run()), asyncio.create_task(self._do_chores())]
        await self._watch.tried.wait()

    @property
    def waiting(self) -> int:
        """Jobs that wait for a worker."""
        return self._dispatcher.waiting

    @property
    def running(self) -> int:
        """Jobs being solved."""
        return self._dispatcher.running

    async def drain(self, seconds: float) -> None:
        """Take nothing more in, let what runs come to an end within a time, put the rest back into the queue."""
        self._closing = True
        if self._drained is None:
            self._drained = asyncio.create_task(self._dispatcher.drain(seconds))
        await asyncio.shield(self._drained)

    async def close(self, seconds: float) -> None:
        """`drain`, and let go of everything."""
        await self.drain(seconds)
        for task in self._background:
            task.cancel()
        await asyncio.gather(*self._background, return_exceptions=True)
        await self._store.close()

    # ------------------------------------------------------------------------------------------------------- taking in

    async def submit(self, accepted: Accepted, client: str = "", key: str | None = None) -> Job:
        """Take a request in. Once this returns it is stored, and is solved without further calls.

        Args:
            accepted: the request.
            client: who sent it.
            key: idempotency key: the same body with the same key is the same job.

        Raises:
            QueueFull, Closing, KeyReused, KeyBusy: it was not taken in.
        """
        if self._closing:
            raise Closing("The service is being stopped. Try again in a few seconds.", retry_after=5)
        self._store.refuse()
        # Shielded: what is stored must also be carried out, even if nobody waits for the answer any more.
        if key is None:
            return await asyncio.shield(self._take_in(accepted, client, None))
        if (client, key) in self._accepting:
            raise KeyBusy("A request with this Idempotency-Key is being taken in. Try again in a second.", 1)
        self._accepting.add((client, key))
        try:
            return await asyncio.shield(self._take_in_once(accepted, client, key))
        finally:
            self._accepting.discard((client, key))

    async def _take_in_once(self, accepted: Accepted, client: str, key: str) -> Job:
        """The job of a key, whether it is there already or not."""
        found = await self._store.read(self._store.store.with_key, client, key)
        if found is None:
            try:
                return await self._take_in(accepted, client, key)
            except KeyTaken:  # by a request whose connection was lost while it was taken in
                found = await self._store.read(self._store.store.with_key, client, key)
        if found is None or found.body_hash != accepted.body_hash:
            raise KeyReused("This Idempotency-Key came with another body before. Take a new key for a new request.")
        return found.job

    async def _take_in(self, accepted: Accepted, client: str, key: str | None) -> Job:
        """Store a new job, running if a worker is free, and carry it out."""
        dispatcher = self._dispatcher
        at_once = dispatcher.reserve()
        if not at_once:
            self._check_room(client)
        job = _new_job(accepted, client)
        active = Active(job)
        events = [active.event_log.state(1, "status", status="queued")]
        if at_once:
            job = replace(job, status=JobStatus.RUNNING, started_at=job.created_at, attempts=1, revision=2)
            events.append(active.event_log.state(2, "status", status="running", attempt=1))
        self._storing[client] += not at_once
        self._on_the_way.add(job.id)  # nobody else takes it up before it is in good hands
        try:
            job = await self._added(job, events, key, accepted.body_hash)
        except BaseException:
            self._on_the_way.discard(job.id)
            if at_once:
                dispatcher.release()
            raise
        finally:
            self._storing[client] -= not at_once
        active.event_log.saved(events[-1].number)
        active.event_log.tell(*events)
        # Request and form are long, and are read again when its turn comes.
        active.job = job if at_once else replace(job, request="", prepared=None)
        (dispatcher.run if at_once else dispatcher.queue)(active)
        self._on_the_way.discard(job.id)
        return job

    def _check_room(self, client: str) -> None:
        """Refuse a job that finds no place in the queue; the places of a client are its own.

        Raises:
            QueueFull: there is none.
        """
        own = self._dispatcher.waiting_of(client) + self._storing[client]
        every = self._dispatcher.waiting + self._storing.total()
        if own >= self._capacity.max_queued or every >= self._capacity.max_queued_in_all:
            number = f"{own} of your layouts" if own >= self._capacity.max_queued else f"{every} layouts"
            wait = self._dispatcher.retry_after()
            raise QueueFull(f"{number} are waiting already. Try again in {wait} s.", wait)

    async def _added(self, job: Job, events: list[JobEvent], key: str | None, body_hash: str) -> Job:
        """Store a new job. Where the answer is lost it is looked for; what turns up later the watch takes up."""
        try:
            return await self._store.change(self._store.store.add, job, events, key, body_hash)
        except LeaseLost:
            raise
        except StoreUnavailable as error:
            if not error.lasting:  # otherwise looking takes as long again, and finds nothing
                with suppress(StoreUnavailable):
                    found = await self.get(job.id)
                    if found is not None:
                        return found
            raise

    # --------------------------------------------------------------------------------------------------------- looking

    async def get(self, job_id: str) -> Job | None:
        """The present state, or None if there is no such job (any more)."""
        return await self._store.read(self._store.store.get, job_id)

    async def page(self, limit: int, after: int | None, chosen: JobFilter) -> list[Job]:
        """Heads of at most ``limit`` jobs, the newest first, continuing behind the job with the number ``after``."""
        return await self._store.read(self._store.store.page, limit, after, chosen)

    async def wait(self, job_id: str, timeout: float) -> Job | None:
        """The state of a job once it is finished, or after ``timeout`` s, whatever comes first."""
        active = self._dispatcher.active.get(job_id)
        if active is not None:
            await asyncio.wait([active.finished], timeout=timeout)
            job = active.finished.result() if active.finished.done() else None
            if job is not None and job.request:
                return job
        return await self.get(job_id)

    async def has_events(self, job_id: str, after: int) -> bool:
        """Whether events with numbers above ``after`` are stored."""
        return bool(await self._store.read(self._store.store.events, job_id, after, 1))

    async def follow(self, job_id: str, after: int, silence: float) -> AsyncIterator[JobEvent | None]:
        """Events of a job with numbers above ``after``, up to its last one; None after ``silence`` s without any."""
        quiet = 0.0
        while not self._closing:
            async for event in self._follow_here(job_id, after, silence):
                yield event
                after, quiet = (after if event is None else event.number), 0.0
                if event is not None and event.kind == LAST:
                    return
            if job_id in self._dispatcher.active:
                continue
            job = await self.get(job_id)
            if job is None or (job.status.finished and not await self.has_events(job_id, after)):
                return
            await asyncio.sleep(POLL_EVERY)  # another server has it, or nobody yet
            quiet += POLL_EVERY
            if quiet >= silence:
                yield None
                quiet = 0.0

    async def _follow_here(self, job_id: str, after: int, silence: float) -> AsyncIterator[JobEvent | None]:
        """What is stored, and what happens as long as this server has the job."""
        active = self._dispatcher.active.get(job_id)
        while stored := await self._store.read(self._store.store.events, job_id, after, EVENTS_AT_ONCE):
            for event in stored:
                yield event
                after = event.number
        while active is not None:
            fresh = active.event_log.after(after)
            for event in fresh:
                yield event
                after = event.number
            if active.event_log.closed and not fresh:
                return
            if not fresh and not await active.event_log.news(silence):
                yield None

    # -------------------------------------------------------------------------------------------------------- changing

    async def cancel(self, job_id: str) -> Job | None:
        """End a job that has not ended, at once and for good; its state, or None if there is no such job.

        Its worker is free again within a second.

        Raises:
            AlreadyFinished: it has ended otherwise.
        """
        return await asyncio.shield(self._cancel(job_id))

    async def _cancel(self, job_id: str) -> Job | None:
        self._store.refuse()
        job = await self.get(job_id)
        if job is None:
            return None
        active = self._dispatcher.active.get(job_id) or Active(job)
        event = active.event_log.state(
            active.job.revision + 1, LAST, status=JobStatus.CANCELLED.value, ended=CALLED_OFF.ended
        )
        head = None if job.status.finished else await self._cancelled(job_id, event)
        if head is not None:
            self._dispatcher.end(active, head, event)
            active.call_off()
            return replace(head, request=job.request)
        job = await self.get(job_id)
        if job is not None and job.status is not JobStatus.CANCELLED:
            raise AlreadyFinished(
                f"The layout has {job.status.value} already; only a layout under way can be cancelled."
            )
        return job

    async def _cancelled(self, job_id: str, event: JobEvent) -> Job | None:
        """Store that a job is cancelled; its head, or None if it had ended. An answer that is lost is looked for."""
        try:
            return await self._store.change(self._store.store.cancel, job_id, event)
        except LeaseLost:
            raise
        except StoreUnavailable:
            found = await self.get(job_id)
            if found is None or found.status is not JobStatus.CANCELLED:
                raise
            return found

    async def delete(self, job_id: str) -> bool:
        """Forget a finished job; False if there is no such job.

        Raises:
            NotFinished: it has not ended.
        """
        if await self._store.change(self._store.store.delete, job_id):
            return True
        if await self.get(job_id) is not None:
            raise NotFinished("The layout is queued or running. Cancel it first, or wait until it is finished.")
        return False

    # ------------------------------------------------------------------------------------------------------ background

    async def _do_chores(self) -> None:
        """Store the events of what runs, so that they survive this process; forget the oldest finished jobs."""
        counted = -1
        while True:
            await asyncio.sleep(CHORES_EVERY)
            with suppress(StoreUnavailable):  # the watch tells of it
                await self._save_events()
                ended = self._dispatcher.ended
                if ended != counted:
                    counted = ended
                    if await self._store.read(self._store.store.finished) > self._capacity.keep:
                        await self._store.change(self._store.store.trim, self._capacity.keep)

    async def _save_events(self) -> None:
        active = self._dispatcher.active
        fresh = [(key, event) for key, one in active.items() for event in one.event_log.unsaved()]
        if fresh:
            await self._store.change(self._store.store.add_events, fresh)
            for key, event in fresh:
                if key in active:
                    active[key].event_log.saved(event.number)


def _new_job(accepted: Accepted, client: str) -> Job:
    return Job(
        id=uuid.uuid4().hex,
        name=accepted.name,
        client=client,
        status=JobStatus.QUEUED,
        created_at=datetime.now(UTC),
        request=accepted.text,
        prepared=accepted.prepared,
        request_hash=accepted.request_hash,
        time_limit=accepted.time_limit,
        certificate_time=accepted.certificate_time,
        runs=accepted.runs,
    )
