"""Jobs as JSON resources. Request and result are JSON already and are put in as they are."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Any

from duocell.service.common.timestamps import timestamp
from duocell.service.jobs.job import Job, JobStatus
from duocell.service.requests.accept import Accepted
from duocell.service.results.older_results import completed


def layout_text(job: Job) -> str:
    """JSON of a layout resource."""
    fields = {name: json.dumps(value, ensure_ascii=False) for name, value in _head(job).items()}
    fields["error"] = (
        "null"
        if job.failure is None
        else json.dumps({"code": job.failure.code, "detail": job.failure.detail}, ensure_ascii=False)
    )
    fields["request"] = job.request
    fields["result"] = "null" if job.result is None else completed(job.result)
    return "{" + ",".join(f'"{name}":{text}' for name, text in fields.items()) + "}"


def solved_here(accepted: Accepted, result: dict[str, Any], created: datetime) -> dict[str, Any]:
    """The resource of a request that the command line has solved itself: no server has given it an id."""
    return {
        "name": accepted.name,
        "status": JobStatus.SUCCEEDED.value,
        "created_at": timestamp(created),
        "request": json.loads(accepted.text),
        "result": result,
    }


def summary(job: Job) -> dict[str, Any]:
    """A layout in a list."""
    return {**_head(job), "outcome": job.outcome, "objective": job.objective, "version": job.version, "href": href(job)}


def href(job: Job) -> str:
    """Address of a job."""
    return f"/v1/layouts/{job.id}"


def etag(job: Job) -> str:
    """Changes whenever the job does."""
    return f'W/"{job.id}-{job.revision}"'


def _head(job: Job) -> dict[str, Any]:
    return {
        "id": job.id,
        "name": job.name,
        "status": job.status.value,
        "attempts": job.attempts,
        "created_at": timestamp(job.created_at),
        "started_at": timestamp(job.started_at),
        "finished_at": timestamp(job.finished_at),
        "ended": job.ended,
    }
