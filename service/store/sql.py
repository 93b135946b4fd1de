"""The store in SQLite or PostgreSQL."""

from __future__ import annotations

import logging
import sqlite3
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, func, literal, select, tuple_
from sqlalchemy.exc import DBAPIError, IntegrityError, SQLAlchemyError
from sqlalchemy.orm import Session, undefer

from service.jobs.job import Ending, Job, JobEvent
from service.store import changes
from service.store.engine import IMMEDIATE, lock_file, make_engine
from service.store.job_store import JobFilter, Keyed, KeyTaken, StoreUnavailable
from service.store.migrate import check_revision, upgrade
from service.store.possession import AdvisoryLock, FileLock, Possession
from service.store.rows import head_of, whole_of
from service.store.tables import EventRow, JobRow

log = logging.getLogger(__name__)

WHOLE = (undefer(JobRow.request), undefer(JobRow.result))


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
        with self._writing() as connection:
            changes.beat(connection)

    # ------------------------------------------------------------------------------------------------------------ jobs

    def add(self, job: Job, events: Sequence[JobEvent], key: str | None = None, body_hash: str = "") -> None:
        """See `JobStore`."""
        try:
            with self._writing() as connection:
                changes.add(connection, job, key, body_hash)
                changes.tell(connection, [(job.id, event) for event in events])
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
        rows = select(JobRow).where(JobRow.status.in_(changes.ACTIVE)).order_by(JobRow.created_at, JobRow.id)
        with self._reading() as session:
            return [head_of(row) for row in session.scalars(rows)]

    def finished(self) -> int:
        """See `JobStore`."""
        with self._reading() as session:
            return session.scalar(select(func.count()).where(JobRow.finished_at.is_not(None))) or 0

    # ------------------------------------------------------------------------------------------------ changes of state

    def claim(self, job_id: str, events: Sequence[JobEvent]) -> Job | None:
        """See `JobStore`."""
        return self._change(changes.claim, job_id, events)

    def put_back(self, job_id: str, attempts: int, events: Sequence[JobEvent], *, counted: bool) -> Job | None:
        """See `JobStore`."""
        return self._change(changes.put_back, job_id, events, attempts, attempts if counted else attempts - 1)

    def finish(self, job_id: str, attempts: int, ending: Ending, events: Sequence[JobEvent]) -> Job | None:
        """See `JobStore`."""
        return self._change(changes.finish, job_id, events, attempts, ending)

    def cancel(self, job_id: str, event: JobEvent) -> Job | None:
        """See `JobStore`."""
        return self._change(changes.cancel, job_id, [event])

    def _change(
        self, change: Callable[..., Job | None], job_id: str, events: Sequence[JobEvent], *arguments: Any
    ) -> Job | None:
        """Change a job and tell of it, or neither."""
        with self._writing() as connection:
            job = change(connection, job_id, *arguments)
            if job is not None:
                changes.tell(connection, [(job_id, event) for event in events])
            return job

    def delete(self, job_id: str) -> bool:
        """See `JobStore`."""
        with self._writing() as connection:
            return changes.forget(connection, job_id)

    def trim(self, keep: int) -> int:
        """See `JobStore`."""
        with self._writing() as connection:
            return changes.trim(connection, keep)

    # ---------------------------------------------------------------------------------------------------------- events

    def add_events(self, events: Sequence[tuple[str, JobEvent]]) -> None:
        """See `JobStore`."""
        with self._writing() as connection:
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
        with _explained(), Session(self._engine) as session:
            yield session

    @contextmanager
    def _writing(self) -> Iterator[Connection]:
        """A transaction that is stored as a whole when the block ends, or not at all."""
        with self._turn, _explained(), self._writing_engine.begin() as connection:
            yield connection


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
