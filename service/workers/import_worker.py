"""Where uploads are read: each in a process of its own, one after the other, ended when it takes too long.

The readers and the decomposition are C++ that was not written for hostile files; here they can take nothing with them.
The catalogue is listed there too: it takes seconds, in which the server has other things to do.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.common.problems import Problem
from duocell.service.workers.executor import Report, WorkerDied
from duocell.service.workers.worker_process import WorkerProcess

log = logging.getLogger(__name__)

Made = TypeVar("Made")

RETRY_AFTER = "5"
STARTS = 3
"""Times that a process is started for an upload; after a failure the next one is forked from another fork server."""


class Words(NamedTuple):
    """What to say to somebody whose upload takes too long: what is done with it, the setting, what to do."""

    doing: str
    setting: str
    advice: str


MESHES = Words(
    "Reading it and taking its meshes apart", "DUOCELL_UPLOAD_TIME_LIMIT", "Send simplified collision meshes."
)


def _nobody(kind: str, data: str) -> None:
    """Follows nothing."""


class ImportWorker:
    """Reads uploads.

    A process is forked for every upload: that takes milliseconds, and none is there that could have died meanwhile.

    Args:
        time_limit: s that an upload may take.
        words: for uploads that take longer.
    """

    def __init__(self, time_limit: float, words: Words = MESHES) -> None:
        self._time_limit = time_limit
        self._words = words
        self._turn = asyncio.Lock()
        self._processes: set[WorkerProcess] = set()

    async def run(self, function: Callable[..., Made], *arguments: Any, report: Report = _nobody) -> Made:
        """What a function makes of an upload.

        Args:
            function: of a module, so that another process finds it; raises `InvalidRequest` if it is to blame.
            arguments: plain data.
            report: told kind and JSON data of what the function tells (`duocell.optimizer.monitoring.watch.tell`).

        Raises:
            InvalidRequest: the function refuses it, takes too long, or breaks down over it.
            Problem: no process could be started for it.
        """
        async with self._turn:
            process = await _started()
            self._processes.add(process)
            process.ended.add_done_callback(lambda _: self._processes.discard(process))
            try:
                async with asyncio.timeout(self._time_limit):
                    await process.warm()
                    reply = process.begin(_answer, (function, *arguments), report)
                    made, issues = await asyncio.shield(reply)
            except TimeoutError as error:
                doing, setting, advice = self._words
                detail = f"{doing} takes longer than {self._time_limit:g} s ({setting}). {advice}"
                raise _refused(detail, "too-large") from error
            except WorkerDied as error:
                log.error("the process that read an upload ended: %s", error.detail)
                detail = "The process that read it broke down. Is it in order? Check it with another program."
                raise _refused(detail, "invalid-upload") from error
            finally:
                process.kill()
        if issues:
            raise InvalidRequest(issues)
        return cast(Made, made)

    async def stop(self) -> None:
        """End the process that reads, if there is one; returns when it is gone."""
        for process in self._processes:
            process.kill()
        await asyncio.gather(*(process.ended for process in self._processes))


async def _started() -> WorkerProcess:
    """A process for one upload.

    Raises:
        Problem: there is none to be had.
    """
    for _ in range(STARTS):
        try:
            return await WorkerProcess.start(tested=False)
        except (TimeoutError, OSError, EOFError) as error:
            log.error("no process for an upload: %r", error)
    raise Problem(
        "uploads-unavailable",
        "No process could be started that reads it. Try again; the log of the server has the details.",
        headers={"Retry-After": RETRY_AFTER},
    )


def _answer(function: Callable[..., Made], *arguments: Any) -> tuple[Made | None, list[Issue]]:
    """Runs in the process; exceptions with data in them do not travel well."""
    try:
        return function(*arguments), []
    except InvalidRequest as error:
        return None, list(error.issues)
    except MemoryError:
        return None, [Issue("", "There is not enough memory for it. Send simplified collision meshes.", "too-large")]


def _refused(detail: str, code: str) -> InvalidRequest:
    return InvalidRequest([Issue("", detail, code)])
