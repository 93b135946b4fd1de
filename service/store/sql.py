"""The store in SQLite or PostgreSQL."""

from __future__ import annotations

import logging
import sqlite3
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from sqlalchemy import Connection, func, select
from sqlalchemy.exc import DBAPIError, IntegrityError, SQLAlchemyError
from sqlalchemy.orm import Session, undefer

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job import CALLED_OFF, Ending, Job, JobEvent
from duocell.service.jobs.job_store import JobFilter, Keyed, KeyTaken, NoAnswer
from duocell.service.store import changes
from duocell.service.store.engine import IMMEDIATE, database_file, make_engine
from duocell.service.store.lease import StoreLease
from duocell.service.store.migrate import check_revision, upgrade
from duocell.service.store.rows import head_of, whole_of
from duocell.service.store.session_lock import AdvisoryLock, FileLock
from duocell.service.store.sqlite_file import SqliteFile, is_damage
from duocell.service.store.tables import EventRow, JobRow

log = logging.getLogger(__name__)

WHOLE = (undefer(JobRow.request), undefer(JobRow.result))
TURN_WITHIN = 5.0
"""s that a thread waits for its turn to write."""


class SqlJobStore:
    """See `duocell.service.jobs.job_store.JobStore`.

    Threads take turns at writing: SQLite has one writer at a time anyway, and lets those that wait sleep longer than
    they have to.
    """

    def __init__(self, url: str) -> None:
        self.owner = uuid.uuid4().hex
        self._engine = make_engine(url)
        self._writing_engine = self._engine.execution_options(**{IMMEDIATE: True})
        self._turn = threading.Lock()
        sqlite = self._engine.dialect.name == "sqlite"
        self._file = SqliteFile(database_file(self._engine.url)) if sqlite else None
        self._lock: FileLock | AdvisoryLock = (
            AdvisoryLock(self._engine, int(self.owner[:15], 16)) if self._file is None else FileLock(self._file.path)
        )
        self._lease = StoreLease(self.owner, self._lock)
        self._damaged = False

    # ------------------------------------------------------------------------------------------------ the store itself

    def open(self) -> None:
        """See `JobStore`. SQLite is migrated here; PostgreSQL, which may have other readers, by `duocell migrate`."""
        with self._in_turn(), self._explained():
            if self._file is None:
                check_revision(self._engine)  # before the lock, which would be in the way of a migration
            self._lock.hold()
            if self._file is not None:
                self._open_file(self._file)
            with self._writing_engine.begin() as connection:
                self._lease.take(connection)

    def _open_file(self, file: SqliteFile) -> None:
        before, after = upgrade(self._engine)
        if before not in (None, after):
            log.warning("the tables were migrated from revision %s to %s", before, after)
        file.keep_open()
        file.verify()
        file.examine()
        self._damaged = False

    def close(self) -> None:
        """See `JobStore`."""
        try:
            with self._in_turn(), self._explained(), self._writing_engine.begin() as connection:
                self._lease.release(connection)
        except StoreUnavailable:
            pass  # another server will see that this one is gone
        self._lock.release()
        if self._file is not None:
            self._file.close()
        self._engine.dispose()

    def check(self) -> None:
        """See `JobStore`."""
        with self._in_turn(), self._explained():
            self._lock.hold()
            if self._damaged and self._file is not None:
                self._file.examine()
                self._damaged = False
        with self._changing() as (connection, _):
            self._lease.beat(connection)

    # ------------------------------------------------------------------------------------------------------------ jobs

    def add(self, job: Job, events: Sequence[JobEvent], key: str | None = None, body_hash: str = "") -> Job:
        """See `JobStore`."""
        try:
            with self._changing() as (connection, number):
                stored = changes.add(connection, number, job, self.owner, key, body_hash)
                changes.tell(connection, [(job.id, event) for event in events])
                return stored
        except IntegrityError as error:
            raise KeyTaken from error

    def with_key(self, client: str, key: str) -> Keyed | None:
        """See `JobStore`."""
        chosen = select(JobRow).where(JobRow.client == client, JobRow.idempotency_key == key).options(*WHOLE)
        with self._reading() as session:
            row = session.scalar(chosen)
            return None if row is None else Keyed(whole_of(row), row.body_hash)

    def get(self, job_id: str) -> Job | None:
        """See `JobStore`."""
        with self._reading() as session:
            row = session.get(JobRow, job_id, options=WHOLE)
            return None if row is None else whole_of(row)

    def page(self, limit: int, after: int | None, chosen: JobFilter) -> list[Job]:
        """See `JobStore`."""
        rows = select(JobRow).order_by(JobRow.sequence.desc(), JobRow.id.desc()).limit(limit)
        if after is not None:
            rows = rows.where(JobRow.sequence < after)
        if chosen.statuses is not None:
            rows = rows.where(JobRow.status.in_([status.value for status in chosen.statuses]))
        if chosen.name is not None:
            rows = rows.where(JobRow.name == chosen.name)
        if chosen.client is not None:
            rows = rows.where(JobRow.client == chosen.client)
        if chosen.created_after is not None:
            rows = rows.where(JobRow.created_at > chosen.created_after)
        if chosen.created_before is not None:
            rows = rows.where(JobRow.created_at < chosen.created_before)
        with self._reading() as session:
            return [head_of(row) for row in session.scalars(rows)]

    def unfinished(self) -> list[Job]:
        """See `JobStore`."""
        rows = select(JobRow).where(JobRow.status.in_(changes.ACTIVE)).order_by(JobRow.sequence, JobRow.id)
        with self._reading() as session:
            return [head_of(row) for row in session.scalars(rows)]

    def finished(self) -> int:
        """See `JobStore`."""
        with self._reading() as session:
            return session.scalar(select(func.count()).where(JobRow.finished_at.is_not(None))) or 0

    # ------------------------------------------------------------------------------------------------ changes of state

    def claim(self, job_id: str, events: Sequence[JobEvent]) -> Job | None:
        """See `JobStore`."""
        return self._change(job_id, events, lambda connection, _: changes.claim(connection, job_id, self.owner))

    def put_back(self, job: Job, events: Sequence[JobEvent], *, counted: bool) -> Job | None:
        """See `JobStore`."""
        left = job.attempts if counted else job.attempts - 1
        return self._change(job.id, events, lambda connection, _: changes.put_back(connection, job, left))

    def finish(self, job: Job, ending: Ending, events: Sequence[JobEvent]) -> Job | None:
        """See `JobStore`."""
        return self._change(job.id, events, lambda connection, number: changes.finish(connection, number, job, ending))

    def cancel(self, job_id: str, event: JobEvent) -> Job | None:
        """See `JobStore`."""
        return self._change(
            job_id, [event], lambda connection, number: changes.cancel(connection, number, job_id, CALLED_OFF)
        )

    def _change(
        self, job_id: str, events: Sequence[JobEvent], change: Callable[[Connection, int], Job | None]
    ) -> Job | None:
        """Change a job and tell of it, or neither."""
        with self._changing() as (connection, number):
            job = change(connection, number)
            if job is not None:
                changes.tell(connection, [(job_id, event) for event in events])
            return job

    def delete(self, job_id: str) -> bool:
        """See `JobStore`."""
        with self._changing() as (connection, _):
            return changes.forget(connection, job_id)

    def trim(self, keep: int) -> int:
        """See `JobStore`."""
        with self._changing() as (connection, _):
            return changes.trim(connection, keep)

    # ---------------------------------------------------------------------------------------------------------- events

    def add_events(self, events: Sequence[tuple[str, JobEvent]]) -> None:
        """See `JobStore`."""
        with self._changing() as (connection, _):
            known = changes.known(connection, {job_id for job_id, _ in events})
            changes.tell(connection, [(job_id, event) for job_id, event in events if job_id in known])

    def events(self, job_id: str, after: int, limit: int) -> list[JobEvent]:
        """See `JobStore`."""
        rows = select(EventRow).where(EventRow.job_id == job_id, EventRow.number > after)
        with self._reading() as session:
            found = session.scalars(rows.order_by(EventRow.number).limit(limit))
            return [JobEvent(row.number, row.kind, row.data) for row in found]

    # ---------------------------------------------------------------------------------------------------- transactions

    @contextmanager
    def _reading(self) -> Iterator[Session]:
        with self._explained(), Session(self._engine) as session:
            yield session

    @contextmanager
    def _changing(self) -> Iterator[tuple[Connection, int]]:
        """A transaction of the owner, with its number, that is stored as a whole when the block ends, or not at all."""
        with self._in_turn():
            self._verify()
            with self._explained(), self._writing_engine.begin() as connection:
                yield connection, self._lease.fence(connection)
            self._verify()

    def _verify(self) -> None:
        """See that what is written can be found again."""
        self._lock.verify()
        if self._file is not None:
            self._file.verify()

    @contextmanager
    def _in_turn(self) -> Iterator[None]:
        if not self._turn.acquire(timeout=TURN_WITHIN):
            raise StoreUnavailable(f"The store of the jobs was busy for {TURN_WITHIN:g} s.")
        try:
            yield
        finally:
            self._turn.release()

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Errors of the database become `StoreUnavailable`; the log gets the words of the database."""
        try:
            yield
        except IntegrityError:
            raise
        except (SQLAlchemyError, sqlite3.Error) as error:
            original = error.orig if isinstance(error, DBAPIError) else error
            cause = str(original).strip()
            log.warning("the store failed: %s", cause)
            self._damaged = self._damaged or is_damage(original)
            told = f": {cause}" if isinstance(original, sqlite3.Error) else ""  # others name hosts
            broke = (
                isinstance(error, DBAPIError) and error.connection_invalidated and not isinstance(original, NoAnswer)
            )
            detail = f"The store of the jobs cannot be used at the moment{told}."
            raise StoreUnavailable(detail, lasting=not broke) from error
