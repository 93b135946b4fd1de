"""Resources of the service, as they are published in the OpenAPI document."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import ConfigDict, Field

from duocell.service.schemas.base import Answer, Moment
from duocell.service.schemas.request import LayoutRequest
from duocell.service.schemas.result import LayoutResult

Status = Literal["queued", "running", "succeeded", "failed", "cancelled"]
_ID = "5f0c9a7d8e3b4c21a6f7d0e9b8c7a6f5"
_TIME = "2026-11-22T09:30:00.000000Z"


class Failure(Answer):
    """Why a layout failed: a fault of the service, never of the request."""

    code: str = Field(
        description="Stable name: time-limit, worker-died, interrupted, solver-failure, out-of-memory, no-worker, "
        "internal.",
        examples=["worker-died"],
    )
    detail: str = Field(description="One sentence.", examples=["The worker was ended by signal SIGKILL."])


class Ended(Answer):
    """What ended a layout."""

    by: str = Field(
        description="`answer`: the solve came to its own end; `time-limit`: it had no more time, and the result is the "
        "best that was known; `cancelled`; or the code of the error.",
        examples=["time-limit"],
    )
    detail: str | None = Field(description="One sentence.", examples=["A client called it off."])


class LayoutHead(Answer):
    """What a layout and its entry in a list have in common."""

    id: str = Field(description="Identifier.", examples=[_ID])
    name: str = Field(description="Label of the request.", examples=["line"])
    status: Status = Field(description="Where it is.", examples=["succeeded"])
    attempts: int = Field(description="How often a worker has taken it up.", examples=[1])
    created_at: Moment = Field(description="RFC 3339.", examples=[_TIME])
    started_at: Moment | None = Field(description="When a worker took it up.", examples=[_TIME])
    finished_at: Moment | None = Field(description="When it ended.", examples=[_TIME])
    ended: Ended | None = Field(
        description="What ended it; null until then, and for layouts that older versions have solved.", examples=[None]
    )


class Layout(LayoutHead):
    """A request for a layout and what became of it."""

    error: Failure | None = Field(description="Why it failed, if it did.", examples=[None])
    request: LayoutRequest = Field(description="The request with every default filled in.")
    result: LayoutResult | None = Field(description="The answer, once it succeeded.")


class LayoutSummary(LayoutHead):
    """A layout in a list."""

    outcome: str | None = Field(description="Of the result, if there is one.", examples=["optimal"])
    objective: float | None = Field(description="Of the result, if there is one.", examples=[155.2])
    version: str | None = Field(
        description="Version of the program that made the result, if there is one; what `outcome` means depends on it.",
        examples=["0.2.0"],
    )
    href: str = Field(description="Address of the whole resource.", examples=[f"/v1/layouts/{_ID}"])


class LayoutPage(Answer):
    """Some layouts, the newest first."""

    items: list[LayoutSummary] = Field(description="The layouts.")
    next_cursor: str | None = Field(
        description="Send it as `cursor` for the next page; null at the end.", examples=[None]
    )


class ProblemEntry(Answer):
    """One thing that is wrong with the request."""

    pointer: str = Field(
        description="JSON pointer (RFC 6901) into the body; empty: the whole.", examples=["/arms/0/robot"]
    )
    detail: str = Field(
        description="What is wrong there, what is allowed, what to do.",
        examples=["no robot is called 'ur10x'; the nearest of 73 names are ur10, ur10e."],
    )


class ProblemDocument(Answer):
    """An error (RFC 9457)."""

    model_config = ConfigDict(title="Problem")

    type: str = Field(
        description="Address of an explanation of this kind of problem.", examples=["/problems/unknown-robot"]
    )
    title: str = Field(description="Kind of problem in words.", examples=["No such robot"])
    status: int = Field(description="HTTP status.", examples=[422])
    detail: str = Field(description="What happened this time.", examples=["/arms/0/robot: no robot is called 'ur10x'"])
    instance: str = Field(description="Address that was asked.", examples=["/v1/layouts"])
    code: str = Field(description="Kind of problem, stable name.", examples=["unknown-robot"])
    errors: list[ProblemEntry] = Field(description="Places in the body; empty if the body is not to blame.")


class ProblemKind(Answer):
    """Explanation of a kind of problem."""

    code: str = Field(description="Stable name.", examples=["queue-full"])
    title: str = Field(description="In words.", examples=["Too many layouts are waiting"])
    status: int = Field(description="HTTP status.", examples=[429])
    advice: str = Field(description="What to do.", examples=["Try again after the seconds of the header Retry-After."])


class Health(Answer):
    """The process answers."""

    status: Literal["ok"] = Field(description="Always ok.", examples=["ok"])
    version: str = Field(description="Version of the program.", examples=["0.2.0"])


class Readiness(Answer):
    """The service can solve."""

    status: Literal["ready"] = Field(description="Always ready; otherwise the answer is a problem.", examples=["ready"])
    checks: dict[str, dict[str, Any]] = Field(
        description="store, workers, self_test: whether each holds, and numbers.",
        examples=[{"store": {"ok": True}, "workers": {"ok": True, "alive": 3}, "self_test": {"ok": True, "age": 4.2}}],
    )
