"""/healthz, /readyz, and explanations of problems."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path

from duocell.service.api.state import StateOf
from duocell.service.common.problems import KINDS, Problem
from duocell.service.common.version import package_version
from duocell.service.http.described import answer, problems
from duocell.service.schemas.resources import Health, ProblemKind, Readiness

router = APIRouter(tags=["service"])

ProblemCode = Annotated[str, Path(description="`code` of a problem.", examples=["queue-full"])]


@router.get(
    "/healthz",
    operation_id="get_health",
    summary="Is the process alive?",
    responses={200: answer("It is.")},
)
async def get_health() -> Health:
    """Answers as long as the process does; looks at nothing else."""
    return Health(status="ok", version=package_version())


@router.get(
    "/readyz",
    operation_id="get_readiness",
    summary="Can the service solve?",
    responses={200: answer("It can."), **problems(503)},
)
async def get_readiness(state: StateOf) -> Readiness:
    """Whether the store was written a few seconds ago, workers live, and a self-test solve is at most 30 s old."""
    problem = state.jobs.store_problem
    checks = {"store": {"ok": not problem, "detail": problem}, **state.monitor.report()}
    failed = [name for name, check in checks.items() if not check["ok"]]
    if failed:
        why = "; ".join(f"{name}: {checks[name].get('detail') or 'fails'}" for name in failed)
        raise Problem("not-ready", why, headers={"Retry-After": "1"})
    return Readiness(status="ready", checks=checks)


@router.get(
    "/problems/{code}",
    operation_id="get_problem",
    summary="What does a problem mean?",
    responses={200: answer("It means this."), **problems(404)},
)
async def get_problem(code: ProblemCode) -> ProblemKind:
    """Explains the `type` of an error answer."""
    if code not in KINDS:
        raise Problem("not-found", f"There is no kind of problem called {code[:80]!r}; known are {', '.join(KINDS)}.")
    return ProblemKind.of(KINDS[code], code=code)
