"""What runs in a worker process.

The engines are imported inside the functions: the server names these functions too, but never loads what they use.
"""

from __future__ import annotations

import json
import logging
import multiprocessing
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from models.errors import DuocellError
from service.self_test import SELF_TEST, check

if TYPE_CHECKING:
    from service.library import Library

log = logging.getLogger(__name__)

SELF_TEST_LIMIT = 10.0
"""s, soft limit of a self-test."""


class Answer(NamedTuple):
    """What a worker sends back; exceptions stay where they happened, since not all of them can be sent.

    Attributes:
        text: JSON of the result, or None if there is none.
        outcome: its outcome.
        objective: its objective.
        code: stable name of the failure, or "".
        detail: sentence about the failure.
    """

    text: str | None
    outcome: str | None = None
    objective: float | None = None
    code: str = ""
    detail: str = ""


def initialize() -> None:
    """See to it that this worker can solve before it takes anything up, and that it does not outlive the server."""
    threading.Thread(target=_leave_with_parent, name="parent-watch", daemon=True).start()
    self_test()


def solve(text: str, request_hash: str, time_limit: float, data_dir: Path | None = None) -> Answer:
    """Solve an accepted request; what it names of users' robots and meshes lies in ``data_dir``."""

    def work() -> dict[str, Any]:
        from service.solving import solve_request

        return solve_request(text, request_hash, time_limit, _library(data_dir))

    return _answer(work)


def evaluate(text: str, request_hash: str, data_dir: Path | None = None) -> Answer:
    """Evaluate the layout of an accepted request; ``data_dir`` as for `solve`."""

    def work() -> dict[str, Any]:
        from service.solving import evaluate_request

        return evaluate_request(text, request_hash, _library(data_dir))

    return _answer(work)


def _library(data_dir: Path | None) -> Library | None:
    """What users brought; what was deleted since the request was accepted still counts."""
    from service.library import Library

    return None if data_dir is None else Library(data_dir, deleted=True)


def _answer(work: Callable[[], dict[str, Any]]) -> Answer:
    """The result of some work, or why there is none."""
    try:
        result = work()
        return Answer(json.dumps(result, allow_nan=False), result["outcome"], result["objective"])
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


def _leave_with_parent() -> None:
    """A server that was killed cannot stop its workers: they stop themselves."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
