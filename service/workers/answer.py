"""What a worker sends back of a solve."""

from __future__ import annotations

import json
from typing import Any, NamedTuple

ANSWER, TIME_LIMIT = "answer", "time-limit"
"""What ends a solve with a result: it came to its own end, or had no more time."""
KNOWN = "known"
"""Kind of the message with an answer to fall back on; it is for the server and never an event of a job."""


class Answer(NamedTuple):
    """What a worker sends back; exceptions stay where they happened, since not all of them can be sent.

    Attributes:
        text: JSON of the result, or None if there is none.
        outcome: its outcome.
        objective: its objective.
        version: of the program that made it.
        code: stable name of the failure, or "".
        detail: sentence about the failure.
        ended_by: what ended a solve that has a result: `ANSWER`, or `TIME_LIMIT`.
    """

    text: str | None
    outcome: str | None = None
    objective: float | None = None
    version: str | None = None
    code: str = ""
    detail: str = ""
    ended_by: str = ANSWER


def answer_of(result: dict[str, Any]) -> Answer:
    """The answer with a result."""
    text = json.dumps(result, allow_nan=False)
    ended_by = ANSWER if result["search"]["ended"] else TIME_LIMIT
    return Answer(text, result["outcome"], result["objective"], result["version"], ended_by=ended_by)
