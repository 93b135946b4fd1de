"""Solving in this process, for `duocell solve`: with the limits, and the way to end, of a solve in a worker.

A solve that goes on for longer than all its soft limits and the grace of the service is told to stop; what is known
then is the answer, also where it does not listen.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from concurrent.futures import Future, wait
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

from duocell.optimizer.monitoring.watch import Cancelled, watching
from duocell.service.cli.exit_codes import Exit
from duocell.service.cli.progress import display
from duocell.service.jobs.resources import solved_here
from duocell.service.library.library import Library
from duocell.service.requests.accept import Accepted
from duocell.service.settings import Settings
from duocell.service.workers.answer import KNOWN, TIME_LIMIT, Answer
from duocell.service.workers.executor import Report, SolveFailed
from duocell.service.workers.pool import GRACE, limit_threads
from duocell.service.workers.reports import Reports
from duocell.service.workers.worker import solve_following

SOLVE = "solve"
"""Name of the thread that solves."""


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
    told: list[str] = []

    def tell(kind: str, data: str) -> None:
        if kind == KNOWN:
            told.append(Answer(*json.loads(data)).text or "")
        else:
            report(kind, data)

    def work() -> None:
        try:
            with watching(Reports(tell), stop.is_set):
                result = solve_following(accepted.prepared, accepted.request_hash, accepted.time_limit, library)
        except BaseException as error:  # it is raised again by the thread that waits
            answer.set_exception(error)
        else:
            answer.set_result(result)

    threading.Thread(target=work, name=SOLVE, daemon=True).start()
    try:
        return _in_time(answer, stop, soft_limit(accepted) + Settings().grace, told)
    except KeyboardInterrupt:
        stop.set()
        with suppress(Cancelled, TimeoutError):
            answer.result(GRACE)
        if answer.done():
            raise
        sys.stderr.write("interrupted\n")
        sys.stderr.flush()
        os._exit(Exit.INTERRUPTED)  # it does not listen; nothing is left to tidy up


def soft_limit(accepted: Accepted) -> float:
    """s that search, proof, explanation and baselines may take together."""
    return (accepted.time_limit + accepted.certificate_time) * accepted.runs


def _in_time(answer: Future[dict[str, Any]], stop: threading.Event, most: float, told: list[str]) -> dict[str, Any]:
    """The answer; after ``most`` s, and if it does not listen, the last of those that were told meanwhile."""
    wait([answer], most)
    if not answer.done():
        stop.set()
        wait([answer], GRACE)
    if answer.done() and not isinstance(answer.exception(), Cancelled):
        return answer.result()
    if not told:
        raise SolveFailed(TIME_LIMIT, "The time was over before anything was known.")
    known: dict[str, Any] = json.loads(told[-1])
    return known


def leave(code: int) -> None:
    """End this process with a code, if a solve goes on in it that was told to stop: it would not end by itself."""
    if any(thread.name == SOLVE and thread.is_alive() for thread in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
