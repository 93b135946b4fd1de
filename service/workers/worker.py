"""What runs in a worker process.

The engines are imported inside the functions: the server names these functions too, but never loads what they use.
"""

from __future__ import annotations

import json
import logging
import os
import queue
import signal
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from duocell.models.base.errors import DuocellError
from duocell.optimizer.monitoring.watch import Cancelled, watching
from duocell.service.observability import logs
from duocell.service.workers.answer import Answer, answer_of
from duocell.service.workers.messages import receive, send
from duocell.service.workers.self_test import SELF_TEST, check

if TYPE_CHECKING:
    from duocell.service.library.library import Library

log = logging.getLogger(__name__)

SELF_TEST_LIMIT = 10.0
"""s, soft limit of a self-test."""
STOPPED = "cancelled"
"""Code of the answer of a run that was told to stop."""


class Run(NamedTuple):
    """To a worker: call ``function(*arguments)``, which returns plain data: an `Answer` if it solves."""

    number: int
    function: Callable[..., Any]
    arguments: tuple[Any, ...]


class Stop(NamedTuple):
    """To a worker: the run of this number is to end."""

    number: int


class Told(NamedTuple):
    """From a worker: an event of the run of this number, as JSON."""

    number: int
    kind: str
    data: str


class Done(NamedTuple):
    """From a worker: the run of this number has ended; what its function returned. Number 0: the worker is warm."""

    number: int
    answer: Any


def main(channel: socket.socket, tested: bool = True) -> None:
    """The life of a worker: warm up, then one run after the other until the server is gone."""
    logs.configure()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in a terminal is meant for the server
    runs: queue.SimpleQueue[Run] = queue.SimpleQueue()
    stops: set[int] = set()
    threading.Thread(target=_listen, args=(channel, runs, stops), name="listen", daemon=True).start()
    try:
        send(channel, Done(0, self_test() if tested else Answer("")))
        while True:
            run = runs.get()
            answer = _carry_out(run, channel, stops)
            stops.clear()  # the server sends nothing for the next run before it has this answer
            send(channel, Done(run.number, answer))
    except BrokenPipeError:
        os._exit(0)


def _listen(channel: socket.socket, runs: queue.SimpleQueue[Run], stops: set[int]) -> None:
    """Take messages while a run is on; leave with the server, even in the middle of a run."""
    try:
        with channel.makefile("rb") as stream:
            while True:
                message = receive(stream)
                if isinstance(message, Stop):
                    stops.add(message.number)
                else:
                    runs.put(message)
    except (EOFError, OSError):
        os._exit(0)


def _carry_out(run: Run, channel: socket.socket, stops: set[int]) -> Any:
    """One run, followed and stopped through the channel."""
    from duocell.service.workers.reports import Reports

    reports = Reports(lambda kind, data: send(channel, Told(run.number, kind, data)))
    with watching(reports, lambda: run.number in stops):
        return run.function(*run.arguments)


def solve(accepted: bytes | str, request_hash: str, time_limit: float, data_dir: Path | None = None) -> Answer:
    """Solve an accepted request, given as its form or its text.

    What it names of users' robots and meshes lies in ``data_dir``. The best answer so far is told meanwhile, for the
    case that the solve has to be ended.
    """
    return _answer(lambda: solve_following(accepted, request_hash, time_limit, _library(data_dir)))


def solve_following(
    accepted: bytes | str, request_hash: str, time_limit: float, library: Library | None
) -> dict[str, Any]:
    """The result of an accepted request; whoever watches is told the best answer so far meanwhile.

    Raises:
        DuocellError: an engine broke down.
        Cancelled: it was told to stop.
    """
    from duocell.optimizer.monitoring.watch import overhearing, tell
    from duocell.service.workers.best_known import QUICK, BestKnown
    from duocell.service.workers.solving import solve_request

    known = BestKnown(tell, request_hash, time_limit)
    known.begin()
    try:
        with overhearing(known):
            return solve_request(accepted, request_hash, time_limit, library, known.understood)
    except Cancelled:
        known.flush(QUICK)
        raise


def evaluate(accepted: bytes | str, request_hash: str, data_dir: Path | None = None) -> Answer:
    """Evaluate the layout of an accepted request; ``data_dir`` as for `solve`."""

    def work() -> dict[str, Any]:
        from duocell.service.workers.solving import evaluate_request

        return evaluate_request(accepted, request_hash, _library(data_dir))

    return _answer(work)


def _library(data_dir: Path | None) -> Library | None:
    """What users brought; what was deleted since the request was accepted still counts."""
    from duocell.service.library.library import Library

    return None if data_dir is None else Library(data_dir, deleted=True)


def _answer(work: Callable[[], dict[str, Any]]) -> Answer:
    """The result of some work, or why there is none."""
    try:
        return answer_of(work())
    except Cancelled:
        return Answer(None, code=STOPPED, detail="The solve was told to stop.")
    except DuocellError as error:
        return Answer(None, code=error.code, detail=error.detail)
    except MemoryError:
        return Answer(None, code="out-of-memory", detail="The worker ran out of memory. Send fewer poses.")
    except Exception:  # a worker answers whatever happens; the trace goes to the log
        log.exception("work failed")
        detail = "The work ended with an unexpected error; the log of the server has the details."
        return Answer(None, code="internal", detail=detail)


def self_test() -> Answer:
    """Solve a small cell with a known answer."""
    answer = solve(SELF_TEST, "", SELF_TEST_LIMIT)
    if answer.text is None:
        return answer
    wrong = check(json.loads(answer.text))
    return Answer(None, code="self-test", detail=wrong) if wrong else answer
