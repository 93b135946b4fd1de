"""The store in SQLite or PostgreSQL."""

from __future__ import annotations

import logging
import sqlite3
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Any, cast

from sqlalchemy import CursorResult, delete, func, literal, select, tuple_
from sqlalchemy.dialects import postgresql
from sqlalchemy.dialects.sqlite import insert
from sqlalchemy.exc import DBAPIError, IntegrityError, SQLAlchemyError
from sqlalchemy.orm import Session, undefer

from service.job import Ending, Job, JobEvent, JobStatus
from service.store.engine import IMMEDIATE, lock_file, make_engine
from service.store.job_store import JobFilter, Keyed, KeyTaken, StoreUnavailable
from service.store.migrate import check_revision, upgrade
from service.store.possession import AdvisoryLock, FileLock, Possession
from service.store.rows import head_of, row_of, whole_of
from service.store.tables import EventRow, JobRow, Pulse

log = logging.getLogger(__name__)

WHOLE = (undefer(JobRow.request), undefer(JobRow.result))
ACTIVE = (JobStatus.QUEUED.value, JobStatus.RUNNING.value)


class SqlJobStore:
    """See `service.store.job_store.JobStore`.

    Threads take turns at writing: SQLite has one writer at a time anyway, and lets those that wait sleep longer than
    they have to.
    """

    def __init__(self, url: str) -> None:
        self._engine = make_engine(url)
        self._writing_engine = self._engine.execution_options(**{IMMEDIATE: True})
        self._turn = threading.Lock()
        self._sqlite = self._engine.dialect.name == "sqlite"
        self._possession: Possession = (
            FileLock(lock_file(self._engine.url)) if self._sqlite else AdvisoryLock(self._engine)
        )

    # ------------------------------------------------------------------------------------------------ the store itself

    def open(self) -> None:
        """See `JobStore`. SQLite is migrated here; PostgreSQL, which may have other readers, by `duocell migrate`."""
        with self._turn, _explained():
            self._possession.take()
            if not self._sqlite:
                check_revision(self._engine)
                return
            before, after = upgrade(self._engine)
            if before not in (None, after):
                log.warning("the tables were migrated from revision %s to %s", before, after)

    def close(self) -> None:
        """See `JobStore`."""
        self._possession.release()
        self._engine.dispose()

    def check(self) -> None:
        """See `JobStore`."""
        with self._turn, _explained():
            self._possession.take()
        with self._writing() as session:
            session.merge(Pulse(id=1, at=datetime.now(UTC)))

    # ------------------------------------------------------------------------------------------------------------ jobs

    def add(self, job: Job, events: Sequence[JobEvent], key: str | None = None, body_hash: str = "") -> None:
        """See `JobStore`."""
        try:
            with self._writing() as session:
                session.add(row_of(job, key, body_hash))
                session.flush()
                _tell(session, job.id, events)
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

    def page(self, limit: int, after: tuple[datetime, str] | None, chosen: JobFilter) -> list[Job]:
        """See `JobStore`."""
        rows = select(JobRow).order_by(JobRow.created_at.desc(), JobRow.id.desc()).limit(limit)
        if after is not None:
            rows = rows.where(tuple_(JobRow.created_at, JobRow.id) < tuple_(*_typed(after)))
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
        rows = select(JobRow).where(JobRow.status.in_(ACTIVE)).order_by(JobRow.created_at, JobRow.id)
        with self._reading() as session:
            return [head_of(row) for row in session.scalars(rows)]

    def finished(self) -> int:
        """See `JobStore`."""
        with self._reading() as session:
            return session.scalar(select(func.count()).where(JobRow.finished_at.is_not(None))) or 0

    # ------------------------------------------------------------------------------------------------ changes of state

    def claim(self, job_id: str, events: Sequence[JobEvent]) -> Job | None:
        """See `JobStore`."""
        with self._writing() as session:
            row = session.get(JobRow, job_id, options=WHOLE)
            if row is None or row.status != JobStatus.QUEUED:
                return None
            row.status, row.started_at = JobStatus.RUNNING.value, datetime.now(UTC)
            row.attempts += 1
            row.revision += 1
            _tell(session, job_id, events)
            return whole_of(row)

    def put_back(self, job_id: str, attempts: int, events: Sequence[JobEvent], *, counted: bool) -> Job | None:
        """See `JobStore`."""
        with self._writing() as session:
            row = _running(session, job_id, attempts)
            if row is None:
                return None
            row.status, row.started_at = JobStatus.QUEUED.value, None
            row.attempts -= 0 if counted else 1
            row.revision += 1
            _tell(session, job_id, events)
            return head_of(row)

    def finish(self, job_id: str, attempts: int, ending: Ending, events: Sequence[JobEvent]) -> Job | None:
        """See `JobStore`."""
        with self._writing() as session:
            row = _running(session, job_id, attempts)
            if row is None:
                return None
            _end(row, ending)
            _tell(session, job_id, events)
            return head_of(row)

    def cancel(self, job_id: str, event: JobEvent) -> Job | None:
        """See `JobStore`."""
        with self._writing() as session:
            row = session.get(JobRow, job_id, with_for_update=True)
            if row is None or row.status not in ACTIVE:
                return None
            _end(row, Ending(JobStatus.CANCELLED))
            _tell(session, job_id, [event])
            return head_of(row)

    def delete(self, job_id: str) -> bool:
        """See `JobStore`."""
        with self._writing() as session:
            gone = session.execute(delete(JobRow).where(JobRow.id == job_id, JobRow.status.not_in(ACTIVE)))
            return _count(gone) > 0

    def trim(self, keep: int) -> int:
        """See `JobStore`."""
        with self._writing() as session:
            finished = select(JobRow.id).where(JobRow.finished_at.is_not(None))
            kept = finished.order_by(JobRow.finished_at.desc(), JobRow.id.desc()).limit(keep)
            gone = session.execute(delete(JobRow).where(JobRow.finished_at.is_not(None), JobRow.id.not_in(kept)))
            return _count(gone)

    # ---------------------------------------------------------------------------------------------------------- events

    def add_events(self, events: Sequence[tuple[str, JobEvent]]) -> None:
        """See `JobStore`."""
        with self._writing() as session:
            known = set(session.scalars(select(JobRow.id).where(JobRow.id.in_({job_id for job_id, _ in events}))))
            for job_id in known:
                _tell(session, job_id, [event for of, event in events if of == job_id])

    def events(self, job_id: str, after: int, limit: int) -> list[JobEvent]:
        """See `JobStore`."""
        rows = select(EventRow).where(EventRow.job_id == job_id, EventRow.number > after)
        with self._reading() as session:
            found = session.scalars(rows.order_by(EventRow.number).limit(limit))
            return [JobEvent(row.number, row.kind, row.data) for row in found]

    # ---------------------------------------------------------------------------------------------------- transactions

    @contextmanager
    def _reading(self) -> Iterator[Session]:
        with _explained(), Session(self._engine) as session:
            yield session

    @contextmanager
    def _writing(self) -> Iterator[Session]:
        """A transaction that is stored as a whole when the block ends, or not at all."""
        engine = self._writing_engine
        with self._turn, _explained(), Session(engine, expire_on_commit=False) as session, session.begin():
            yield session


def _running(session: Session, job_id: str, attempts: int) -> JobRow | None:
    """The row of a job that is in this very attempt."""
    row = session.get(JobRow, job_id, with_for_update=True)
    held = row is not None and row.status == JobStatus.RUNNING and row.attempts == attempts
    return row if held else None


def _end(row: JobRow, ending: Ending) -> None:
    """Enter a final state."""
    row.status, row.finished_at = ending.status.value, datetime.now(UTC)
    row.revision += 1
    row.result, row.outcome, row.objective = ending.result, ending.outcome, ending.objective
    if ending.failure is not None:
        row.failure_code, row.failure_detail = ending.failure.code, ending.failure.detail


def _tell(session: Session, job_id: str, events: Sequence[JobEvent]) -> None:
    """Add events of one job; those that are there already are left as they are."""
    if events:
        new = insert(EventRow) if session.get_bind().dialect.name == "sqlite" else postgresql.insert(EventRow)
        rows = [{"job_id": job_id, "number": e.number, "kind": e.kind, "data": e.data} for e in events]
        session.execute(new.on_conflict_do_nothing(), rows)


def _count(result: Any) -> int:
    """Rows that a statement changed."""
    return cast("CursorResult[Any]", result).rowcount


def _typed(key: tuple[datetime, str]) -> tuple[Any, Any]:
    """A key as parameters of the types of its columns."""
    return literal(key[0], JobRow.created_at.type), literal(key[1], JobRow.id.type)


@contextmanager
def _explained() -> Iterator[None]:
    """Errors of the database become `StoreUnavailable`; the log gets the words of the database."""
    try:
        yield
    except IntegrityError:
        raise
    except SQLAlchemyError as error:
        cause = str(error.orig if isinstance(error, DBAPIError) else error).strip()
        log.warning("the store failed: %s", cause)
        told = f": {cause}" if isinstance(getattr(error, "orig", None), sqlite3.Error) else ""  # others name hosts
        raise StoreUnavailable(f"The store of the jobs cannot be used at the moment{told}.") from error
