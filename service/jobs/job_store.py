"""What the service promises about stored jobs, whatever stores them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job import Ending, Job, JobEvent, JobStatus

OTHER = (
    "Another server has this store open. Stop it, or give this one its own DUOCELL_DATA_DIR or DUOCELL_DATABASE_URL."
)


class NoAnswer(Exception):
    """A database did not answer in time; whether it has done what it was asked for is not known."""


class LeaseLost(StoreUnavailable):
    """Another server owns the store: nothing was changed, and what this one has begun is the other's now."""


class KeyTaken(Exception):
    """Another job has the same client and idempotency key; nothing was stored."""


@dataclass(frozen=True, slots=True)
class Keyed:
    """A job that was sent with an idempotency key, and the hash of the body it came with."""

    job: Job
    body_hash: str


@dataclass(frozen=True, slots=True)
class JobFilter:
    """Which jobs a list holds; None: any.

    Attributes:
        statuses: one of these. name: exactly this label. client: exactly this one.
        created_after, created_before: exclusive.
    """

    statuses: Collection[JobStatus] | None = None
    name: str | None = None
    client: str | None = None
    created_after: datetime | None = None
    created_before: datetime | None = None


class JobStore(Protocol):
    """Jobs and their events, kept where they survive the death of this process and a loss of power.

    ``owner`` is the token of this process. What holds for every implementation:

    - A call that returns has stored its change durably. Changes are atomic.
    - Calls block, but for some seconds only, and may come from any thread; none holds on to anything between calls.
    - One process at a time owns a store. Another one that tries is told so by `open`, and by every call that changes
      something; it can read.
    - States change only along queued -> running -> succeeded | failed, running -> queued, and queued | running ->
      cancelled. A final state never changes; the job can only be deleted.
    - ``owner`` is the process that has claimed a running job, and ``attempts`` counts how often it was claimed. Both
      are the right to end it: `finish` and `put_back` act only on a running job whose owner and attempts are those
      named, so that nobody who lost a job in between can end it.
    - Jobs and ends have numbers that rise whatever the clock does: they say what is newer.
    - Every change of state raises ``revision`` by one.
    - Events are stored together with the change of state they tell of.
    """

    owner: str

    def open(self) -> None:
        """Take possession of the store and see to it that its tables are those of this version; again if need be.

        Raises:
            LeaseLost: another process owns it. To be tried again later.
            StoreUnavailable: it cannot be reached or written, is damaged, or must be migrated by hand first. Likewise.
        """

    def close(self) -> None:
        """Let go of it."""

    def check(self) -> None:
        """Write something and see that it is still this process that owns it.

        Raises:
            LeaseLost: it is not.
            StoreUnavailable: it cannot be written, or is known to be damaged.
        """

    def add(self, job: Job, events: Sequence[JobEvent], key: str | None = None, body_hash: str = "") -> Job:
        """Store a new job, queued or running already; returns it as it is stored.

        Args:
            job: its first state.
            events: what has happened to it already.
            key: idempotency key; unique among the jobs of a client.
            body_hash: SHA-256 of the body it came with, to tell a repetition from another request.

        Raises:
            KeyTaken: the client has used the key for a job that is still kept.
            StoreUnavailable: it is not known to be stored.
        """

    def with_key(self, client: str, key: str) -> Keyed | None:
        """The job that a client sent with an idempotency key."""

    def get(self, job_id: str) -> Job | None:
        """The present state of a job, with request and result."""

    def page(self, limit: int, after: int | None, chosen: JobFilter) -> list[Job]:
        """Heads of at most ``limit`` jobs, the newest first, continuing behind the job with the number ``after``."""

    def unfinished(self) -> list[Job]:
        """Heads of all queued and running jobs, the oldest first."""

    def finished(self) -> int:
        """How many jobs are finished."""

    def claim(self, job_id: str, events: Sequence[JobEvent]) -> Job | None:
        """Take up a queued job: running, one attempt more, started now. None if it is not queued (any more)."""

    def put_back(self, job: Job, events: Sequence[JobEvent], *, counted: bool) -> Job | None:
        """Queue a running job again; an attempt that is not ``counted`` is taken back.

        None if the job is not running under the owner and the attempt of ``job`` (any more).
        """

    def finish(self, job: Job, ending: Ending, events: Sequence[JobEvent]) -> Job | None:
        """End a running job; its head, or None if it does not run under the owner and attempt of ``job`` (any more)."""

    def cancel(self, job_id: str, event: JobEvent) -> Job | None:
        """End a job that has not ended: cancelled, at once and for good. Its head, or None if it is final already."""

    def delete(self, job_id: str) -> bool:
        """Forget a finished job and its events; False if there is none of that name that is finished."""

    def trim(self, keep: int) -> int:
        """Forget the finished jobs that ended first, so that ``keep`` are left; returns how many were forgotten."""

    def add_events(self, events: Sequence[tuple[str, JobEvent]]) -> None:
        """Store events of jobs (id, event); those of jobs that are gone, and those stored already, are dropped."""

    def events(self, job_id: str, after: int, limit: int) -> list[JobEvent]:
        """At most ``limit`` events of a job with numbers above ``after``, in order."""
