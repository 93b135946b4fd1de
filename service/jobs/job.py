"""A job: a request on its way to a result."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

_ID = re.compile(r"[0-9a-f]{32}")


class JobStatus(StrEnum):
    """Where a job is."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def finished(self) -> bool:
        """True if it will not change any more."""
        return self not in (JobStatus.QUEUED, JobStatus.RUNNING)


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a job failed: a stable code and a sentence."""

    code: str
    detail: str


@dataclass(frozen=True, slots=True)
class Ending:
    """How an attempt ended.

    Attributes:
        status: a final one.
        ended_by: what ended it: "answer", "time-limit", "cancelled", or the code of the failure. detail: in words.
        result: JSON of the result if it succeeded. outcome, objective: of the result.
        version: of the program that made it.
        failure: why there is none.
    """

    status: JobStatus
    result: str | None = None
    outcome: str | None = None
    objective: float | None = None
    version: str | None = None
    failure: Failure | None = None
    ended_by: str | None = None
    detail: str | None = None

    @property
    def ended(self) -> dict[str, str | None]:
        """What ended it, as documents say it."""
        failure = self.failure
        if failure is not None:
            return {"by": self.ended_by or failure.code, "detail": self.detail or failure.detail}
        return {"by": self.ended_by, "detail": self.detail}


CALLED_OFF = Ending(JobStatus.CANCELLED, ended_by="cancelled", detail="A client called it off.")


@dataclass(frozen=True, slots=True)
class Job:
    """One state of a job; a change makes another object with a higher ``revision``.

    Attributes:
        id: 32 hexadecimal digits.
        name: label of the request.
        client: who sent it, "" if clients are not told apart.
        status: where it is.
        request: JSON of the accepted request; "" where only the head of a job was asked for.
        prepared: what a worker is given, see `duocell.service.requests.prepared`; None where that is not at hand: in a
            head, once the job is finished, and in jobs of older versions.
        request_hash: of that request.
        time_limit: s for the search; None in jobs of older versions. certificate_time: s for a proof that come on top.
        runs: searches that it asks for.
        revision: number of this state, from 1.
        attempts: how often it was taken up by a worker.
        owner: token of the server that took it up, None while it waits.
        sequence: place in the order in which jobs were taken in, given by the store: clocks can be set back.
        result: JSON of the result once it succeeded; None also where only the head was asked for.
        outcome, objective, version: of the result, and of the program that made it.
        failure: why it failed.
        ended_by, ended_detail: what ended it; see `Ending`. None until then, and in jobs of older versions.
    """

    id: str
    name: str
    client: str
    status: JobStatus
    created_at: datetime
    request: str
    request_hash: str
    prepared: bytes | None = None
    time_limit: float | None = None
    certificate_time: float = 0.0
    runs: int = 1
    revision: int = 1
    attempts: int = 0
    owner: str | None = None
    sequence: int = 0
    started_at: datetime | None = None
    finished_at: datetime | None = None
    result: str | None = None
    outcome: str | None = None
    objective: float | None = None
    version: str | None = None
    failure: Failure | None = None
    ended_by: str | None = None
    ended_detail: str | None = None

    @property
    def ended(self) -> dict[str, str | None] | None:
        """What ended it, as documents say it; None if it has not ended, or nobody has noted it."""
        if self.ended_by is not None:
            return {"by": self.ended_by, "detail": self.ended_detail}
        if self.failure is not None:
            return {"by": self.failure.code, "detail": self.failure.detail}
        return CALLED_OFF.ended if self.status is JobStatus.CANCELLED else None


def is_job_id(text: str) -> bool:
    """Whether a text can be the identifier of a job."""
    return _ID.fullmatch(text) is not None


@dataclass(frozen=True, slots=True)
class JobEvent:
    """Something that happened to a job.

    Attributes:
        number: rises from event to event of a job; gaps mean nothing.
        kind: stable name.
        data: JSON object.
    """

    number: int
    kind: str
    data: str
