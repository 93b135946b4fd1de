"""Jobs as JSON resources. Request and result are JSON already and are put in as they are."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Any

from duocell.service.common.timestamps import timestamp
from duocell.service.jobs.job import Job, JobStatus
from duocell.service.requests.accept import Accepted
from duocell.service.results.older_results import completed
from duocell.service.schemas.resources import Failure, LayoutHead, LayoutSummary


def layout_text(job: Job) -> str:
    """JSON of a layout resource."""
    head = LayoutHead.model_validate(job).model_dump_json()
    error = "null" if job.failure is None else Failure.model_validate(job.failure).model_dump_json()
    result = "null" if job.result is None else completed(job.result)
    return f'{head[:-1]},"error":{error},"request":{job.request},"result":{result}}}'


def solved_here(accepted: Accepted, result: dict[str, Any], created: datetime) -> dict[str, Any]:
    """The resource of a request that the command line has solved itself: no server has given it an id."""
    return {
        "name": accepted.name,
        "status": JobStatus.SUCCEEDED.value,
        "created_at": timestamp(created),
        "request": json.loads(accepted.text),
        "result": result,
    }


def summary(job: Job) -> LayoutSummary:
    """A layout in a list."""
    return LayoutSummary.of(job, href=href(job))


def href(job: Job) -> str:
    """Address of a job."""
    return f"/v1/layouts/{job.id}"


def etag(job: Job) -> str:
    """Changes whenever the job does."""
    return f'W/"{job.id}-{job.revision}"'
