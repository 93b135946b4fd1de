"""The statements that change jobs. Each is built once: a job takes few milliseconds, and building costs as many.

All are conditional on the state they start from and, where a job runs, on the owner of that run, so that a change that
comes too late or from the wrong server changes nothing. They come after `duocell.service.store.lease.StoreLease.fence`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import BindParameter, Connection, Table, bindparam, delete, insert, inspect, select, update
from sqlalchemy.dialects import postgresql, sqlite

from duocell.service.jobs.job import Ending, Job, JobEvent, JobStatus
from duocell.service.store.rows import claimed_of, head_of, values_of
from duocell.service.store.tables import EventRow, JobRow

QUEUED, RUNNING = JobStatus.QUEUED.value, JobStatus.RUNNING.value
ACTIVE = (QUEUED, RUNNING)


def _table(row: type[Any]) -> Table:
    found = inspect(row).local_table
    if not isinstance(found, Table):
        raise TypeError(f"{row} is mapped to no table")
    return found


JOBS, EVENTS = _table(JobRow), _table(EventRow)
HEAD = [column for column in JOBS.c if column.name not in ("request", "result", "prepared")]
WHICH: BindParameter[Any] = bindparam("which")
ATTEMPTS: BindParameter[Any] = bindparam("which_attempts")
OWNER: BindParameter[Any] = bindparam("which_owner", type_=JOBS.c.owner.type)
NOW = bindparam("now", type_=JOBS.c.created_at.type)
NEXT_REVISION = JOBS.c.revision + 1

ADD = insert(JOBS)
CLAIM = (
    update(JOBS)
    .where(JOBS.c.id == WHICH, JOBS.c.status == QUEUED)
    .values(status=RUNNING, started_at=NOW, attempts=JOBS.c.attempts + 1, owner=OWNER, revision=NEXT_REVISION)
    .returning(*JOBS.c)
)
HELD = (
    JOBS.c.id == WHICH,
    JOBS.c.status == RUNNING,
    JOBS.c.attempts == ATTEMPTS,
    JOBS.c.owner.is_not_distinct_from(OWNER),  # none in jobs of older versions
)
PUT_BACK = (
    update(JOBS)
    .where(*HELD)
    .values(status=QUEUED, started_at=None, owner=None, attempts=bindparam("attempts_left"), revision=NEXT_REVISION)
    .returning(*HEAD)
)
END_VALUES = {
    "status": bindparam("new_status"),
    "finished_at": NOW,
    "ended": bindparam("number"),
    "ended_by": bindparam("new_ended_by"),
    "ended_detail": bindparam("new_ended_detail"),
    "revision": NEXT_REVISION,
    "outcome": bindparam("new_outcome"),
    "objective": bindparam("new_objective"),
    "version": bindparam("new_version"),
    "failure_code": bindparam("new_failure_code"),
    "failure_detail": bindparam("new_failure_detail"),
    "result": bindparam("new_result"),
    "prepared": None,  # no worker will ask for it again
}
FINISH = update(JOBS).where(*HELD).values(END_VALUES).returning(*HEAD)
CANCEL = update(JOBS).where(JOBS.c.id == WHICH, JOBS.c.status.in_(ACTIVE)).values(END_VALUES).returning(*HEAD)
DELETE = delete(JOBS).where(JOBS.c.id == WHICH, JOBS.c.status.not_in(ACTIVE))
TELL = {
    "sqlite": sqlite.insert(EVENTS).on_conflict_do_nothing(),
    "postgresql": postgresql.insert(EVENTS).on_conflict_do_nothing(),
}


def add(connection: Connection, number: int, job: Job, owner: str, key: str | None, body_hash: str) -> Job:
    """Insert a new job as the change of a number; the job as it is stored."""
    stored = replace(job, sequence=number, owner=owner if job.status is JobStatus.RUNNING else None)
    connection.execute(ADD, values_of(stored, key, body_hash))
    return stored


def claim(connection: Connection, job_id: str, owner: str) -> Job | None:
    """Queued to running; the job with what a worker is given."""
    values = {"which": job_id, "which_owner": owner, "now": datetime.now(UTC)}
    row = connection.execute(CLAIM, values).one_or_none()
    return None if row is None else claimed_of(row)


def put_back(connection: Connection, job: Job, attempts_left: int) -> Job | None:
    """Running to queued; the head."""
    row = connection.execute(PUT_BACK, {**_held(job), "attempts_left": attempts_left}).one_or_none()
    return None if row is None else head_of(row)


def finish(connection: Connection, number: int, job: Job, ending: Ending) -> Job | None:
    """Running to a final state; the head."""
    row = connection.execute(FINISH, {**_held(job), **_end(number, ending)}).one_or_none()
    return None if row is None else head_of(row)


def cancel(connection: Connection, number: int, job_id: str, ending: Ending) -> Job | None:
    """Queued or running to cancelled; the head."""
    row = connection.execute(CANCEL, {"which": job_id, **_end(number, ending)}).one_or_none()
    return None if row is None else head_of(row)


def forget(connection: Connection, job_id: str) -> bool:
    """Delete a finished job."""
    return connection.execute(DELETE, {"which": job_id}).rowcount > 0


def trim(connection: Connection, keep: int) -> int:
    """Delete the finished jobs that ended first."""
    finished = JOBS.c.finished_at.is_not(None)
    kept = select(JOBS.c.id).where(finished).order_by(JOBS.c.ended.desc(), JOBS.c.id.desc()).limit(keep)
    return connection.execute(delete(JOBS).where(finished, JOBS.c.id.not_in(kept))).rowcount


def tell(connection: Connection, events: Sequence[tuple[str, JobEvent]]) -> None:
    """Add events; those that are there already are left as they are."""
    if events:
        rows = [{"job_id": job_id, "number": e.number, "kind": e.kind, "data": e.data} for job_id, e in events]
        connection.execute(TELL[connection.dialect.name], rows)


def known(connection: Connection, ids: set[str]) -> set[str]:
    """Those of ``ids`` that are there."""
    return set(connection.scalars(select(JOBS.c.id).where(JOBS.c.id.in_(ids))))


def _held(job: Job) -> dict[str, Any]:
    return {"which": job.id, "which_attempts": job.attempts, "which_owner": job.owner}


def _end(number: int, ending: Ending) -> dict[str, Any]:
    failure = ending.failure
    return {
        "now": datetime.now(UTC),
        "number": number,
        "new_status": ending.status.value,
        "new_result": ending.result,
        "new_outcome": ending.outcome,
        "new_objective": ending.objective,
        "new_version": ending.version,
        "new_failure_code": None if failure is None else failure.code,
        "new_failure_detail": None if failure is None else failure.detail,
        "new_ended_by": ending.ended["by"],
        "new_ended_detail": ending.ended["detail"],
    }
