"""A job that is not finished, and the rules by which jobs are carried out."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

from duocell.service.jobs.event_log import EventLog
from duocell.service.jobs.job import Job
from duocell.service.workers.answer import Answer

ENDED = {
    "answer": "The solve came to its own end.",
    "time-limit": "The time limit of {limit:g} s ended it; the result is the best that was known then.",
}
"""What ends a job with a result, in words."""


@dataclass(frozen=True, slots=True)
class Rules:
    """How jobs are carried out.

    Attributes:
        workers: at the same time. max_attempts: of a job.
        time_limit: s, soft limit of a run without its certificate, where the job has none.
        grace: s beyond all soft limits before a solve is told to stop.
    """

    workers: int
    max_attempts: int
    time_limit: float
    grace: float


@dataclass(eq=False, slots=True)
class Active:
    """A job that is not finished.

    Attributes:
        job: its last state; without the request as long as it waits.
        event_log: its events.
        finished: done when it is; the whole job, or None if this process ends before.
        solving: the solve under way.
        called_off: the solve is to end because the job was cancelled or goes back into the queue.
    """

    job: Job
    event_log: EventLog = field(default_factory=EventLog)
    finished: asyncio.Future[Job | None] = field(default_factory=lambda: asyncio.get_running_loop().create_future())
    solving: asyncio.Task[Answer] | None = None
    called_off: bool = False

    def call_off(self) -> None:
        """Stop the solve."""
        self.called_off = True
        if self.solving is not None:
            self.solving.cancel()

    def give_up(self) -> None:
        """Tell everybody that nothing more will come from here."""
        self.event_log.close()
        if not self.finished.done():
            self.finished.set_result(None)
