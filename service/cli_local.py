"""Solving in this process, for `duocell solve`."""

from __future__ import annotations

import os
import sys
import threading
from concurrent.futures import Future
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

from optimizer.watch import Cancelled, watching
from service.cli import Exit
from service.cli_progress import display
from service.library import Library
from service.requests.accept import Accepted
from service.resources import solved_here
from service.workers.executor import Report
from service.workers.pool import GRACE, limit_threads
from service.workers.reports import Reports


def solve_here(accepted: Accepted, library: Library) -> dict[str, Any]:
    """The resource of a solved request.

    Args:
        accepted: the request.
        library: what users brought.

    Raises:
        DuocellError: an engine broke down.
        KeyboardInterrupt: the solve was stopped.
    """
    created = datetime.now(UTC)
    with display() as report:
        result = _solve(accepted, library, report)
    return solved_here(accepted, result, created)


def _solve(accepted: Accepted, library: Library, report: Report) -> dict[str, Any]:
    """Solve in a thread: an engine deep in its own code keeps no signal handler from running here."""
    limit_threads()
    answer: Future[dict[str, Any]] = Future()
    stop = threading.Event()

    def work() -> None:
        try:
            from service.workers.solving import solve_request

            with watching(Reports(report), stop.is_set):
                result = solve_request(accepted.text, accepted.request_hash, accepted.time_limit, library)
        except BaseException as error:  # it is raised again by the thread that waits
            answer.set_exception(error)
        else:
            answer.set_result(result)

    threading.Thread(target=work, daemon=True).start()
    try:
        return answer.result()
    except KeyboardInterrupt:
        stop.set()
        with suppress(Cancelled, TimeoutError):
            answer.result(GRACE)
        if answer.done():
            raise
        sys.stderr.write("interrupted\n")
        sys.stderr.flush()
        os._exit(Exit.INTERRUPTED)  # it does not listen; nothing is left to tidy up
