"""From jobs to rows and back."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Row

from duocell.service.jobs.job import Failure, Job, JobStatus
from duocell.service.store.tables import JobRow


def values_of(job: Job, key: str | None, body_hash: str) -> dict[str, Any]:
    """The columns of a new job."""
    return {
        "id": job.id,
        "name": job.name,
        "client": job.client,
        "status": job.status.value,
        "revision": job.revision,
        "attempts": job.attempts,
        "owner": job.owner,
        "sequence": job.sequence,
        "created_at": job.created_at,
        "started_at": job.started_at,
        "time_limit": job.time_limit,
        "certificate_time": job.certificate_time,
        "runs": job.runs,
        "idempotency_key": key,
        "body_hash": body_hash,
        "request_hash": job.request_hash,
        "request": job.request,
        "prepared": job.prepared,
    }


def whole_of(row: JobRow | Row[Any]) -> Job:
    """The job in a row, with request and result."""
    return _job(row, row.request, row.result)


def claimed_of(row: Row[Any]) -> Job:
    """The job in a row, with request and what a worker is given."""
    return _job(row, row.request, None, row.prepared)


def head_of(row: JobRow | Row[Any]) -> Job:
    """The job in a row without its long texts."""
    return _job(row, "", None)


def _job(row: JobRow | Row[Any], request: str, result: str | None, prepared: bytes | None = None) -> Job:
    return Job(
        id=row.id,
        name=row.name,
        client=row.client,
        status=JobStatus(row.status),
        created_at=row.created_at,
        request=request,
        request_hash=row.request_hash,
        prepared=prepared,
        time_limit=row.time_limit,
        certificate_time=row.certificate_time,
        runs=row.runs,
        revision=row.revision,
        attempts=row.attempts,
        owner=row.owner,
        sequence=row.sequence,
        started_at=row.started_at,
        finished_at=row.finished_at,
        result=result,
        outcome=row.outcome,
        objective=row.objective,
        version=row.version,
        ended_by=row.ended_by,
        ended_detail=row.ended_detail,
        failure=None if row.failure_code is None else Failure(row.failure_code, row.failure_detail or ""),
    )
