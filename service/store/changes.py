"""The statements that change jobs. Each is built once: a job takes few milliseconds, and building costs as many.

All are conditional on the state they start from, so that a change that comes too late changes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import BindParameter, Connection, Table, bindparam, delete, insert, inspect, select, update
from sqlalchemy.dialects import postgresql, sqlite

from service.jobs.job import Ending, Job, JobEvent, JobStatus
from service.store.rows import head_of, values_of, whole_of
from service.store.tables import EventRow, JobRow, Pulse

QUEUED, RUNNING = JobStatus.QUEUED.value, JobStatus.RUNNING.value
ACTIVE = (QUEUED, RUNNING)


def _table(row: type[Any]) -> Table:
    found = inspect(row).local_table
    if not isinstance(found, Table):
        raise TypeError(f"{row} is mapped to no table")
    return found


JOBS, EVENTS, PULSE = _table(JobRow), _table(EventRow), _table(Pulse)
HEAD = [column for column in JOBS.c if column.name not in ("request", "result")]
WHICH: BindParameter[Any] = bindparam("which")
ATTEMPTS: BindParameter[Any] = bindparam("which_attempts")
NOW = bindparam("now", type_=JOBS.c.created_at.type)
NEXT_REVISION = JOBS.c.revision + 1

ADD = insert(JOBS)
CLAIM = (
    update(JOBS)
    .where(JOBS.c.id == WHICH, JOBS.c.status == QUEUED)
    .values(status=RUNNING, started_at=NOW, attempts=JOBS.c.attempts + 1, revision=NEXT_REVISION)
    .returning(*JOBS.c)
)
HELD = (JOBS.c.id == WHICH, JOBS.c.status == RUNNING, JOBS.c.attempts == ATTEMPTS)
PUT_BACK = (
    update(JOBS)
    .where(*HELD)
    .values(status=QUEUED, started_at=None, attempts=bindparam("attempts_left"), revision=NEXT_REVISION)
    .returning(*HEAD)
)
END_VALUES = {
    "status": bindparam("new_status"),
    "finished_at": NOW,
    "revision": NEXT_REVISION,
    "outcome": bindparam("new_outcome"),
    "objective": bindparam("new_objective"),
    "version": bindparam("new_version"),
    "failure_code": bindparam("new_failure_code"),
    "failure_detail": bindparam("new_failure_detail"),
    "result": bindparam("new_result"),
}
FINISH = update(JOBS).where(*HELD).values(END_VALUES).returning(*HEAD)
CANCEL = update(JOBS).where(JOBS.c.id == WHICH, JOBS.c.status.in_(ACTIVE)).values(END_VALUES).returning(*HEAD)
DELETE = delete(JOBS).where(JOBS.c.id == WHICH, JOBS.c.status.not_in(ACTIVE))
TELL = {
    "sqlite": sqlite.insert(EVENTS).on_conflict_do_nothing(),
    "postgresql": postgresql.insert(EVENTS).on_conflict_do_nothing(),
}


def add(connection: Connection, job: Job, key: str | None, body_hash: str) -> None:
    """Insert a new job."""
    connection.execute(ADD, values_of(job, key, body_hash))


def claim(connection: Connection, job_id: str) -> Job | None:
    """Queued to running; the whole job."""
    row = connection.execute(CLAIM, {"which": job_id, "now": datetime.now(UTC)}).one_or_none()
    return None if row is None else whole_of(row)


def put_back(connection: Connection, job_id: str, attempts: int, attempts_left: int) -> Job | None:
    """Running to queued; the head."""
    values = {"which": job_id, "which_attempts": attempts, "attempts_left": attempts_left}
    row = connection.execute(PUT_BACK, values).one_or_none()
    return None if row is None else head_of(row)


def finish(connection: Connection, job_id: str, attempts: int, ending: Ending) -> Job | None:
    """Running to a final state; the head."""
    row = connection.execute(FINISH, {"which": job_id, "which_attempts": attempts, **_end(ending)}).one_or_none()
    return None if row is None else head_of(row)


def cancel(connection: Connection, job_id: str) -> Job | None:
    """Queued or running to cancelled; the head."""
    row = connection.execute(CANCEL, {"which": job_id, **_end(Ending(JobStatus.CANCELLED))}).one_or_none()
    return None if row is None else head_of(row)


def forget(connection: Connection, job_id: str) -> bool:
    """Delete a finished job."""
    return connection.execute(DELETE, {"which": job_id}).rowcount > 0


def trim(connection: Connection, keep: int) -> int:
    """Delete the finished jobs that ended first."""
    finished = JOBS.c.finished_at.is_not(None)
    kept = select(JOBS.c.id).where(finished).order_by(JOBS.c.finished_at.desc(), JOBS.c.id.desc()).limit(keep)
    return connection.execute(delete(JOBS).where(finished, JOBS.c.id.not_in(kept))).rowcount


def tell(connection: Connection, events: Sequence[tuple[str, JobEvent]]) -> None:
    """Add events; those that are there already are left as they are."""
    if events:
        rows = [{"job_id": job_id, "number": e.number, "kind": e.kind, "data": e.data} for job_id, e in events]
        connection.execute(TELL[connection.dialect.name], rows)


def known(connection: Connection, ids: set[str]) -> set[str]:
    """Those of ``ids`` that are there."""
    return set(connection.scalars(select(JOBS.c.id).where(JOBS.c.id.in_(ids))))


def beat(connection: Connection) -> None:
    """Write the time into the one row of the pulse."""
    now = datetime.now(UTC)
    if not connection.execute(update(PULSE).where(PULSE.c.id == 1).values(at=now)).rowcount:
        connection.execute(insert(PULSE).values(id=1, at=now))


def _end(ending: Ending) -> dict[str, Any]:
    failure = ending.failure
    return {
        "now": datetime.now(UTC),
        "new_status": ending.status.value,
        "new_result": ending.result,
        "new_outcome": ending.outcome,
        "new_objective": ending.objective,
        "new_version": ending.version,
        "new_failure_code": None if failure is None else failure.code,
        "new_failure_detail": None if failure is None else failure.detail,
    }
