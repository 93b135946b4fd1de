"""/healthz, /readyz, and explanations of problems."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Path
from fastapi.responses import JSONResponse, Response

from duocell.service.api.state import StateOf
from duocell.service.common.problems import KINDS, Problem
from duocell.service.common.version import package_version
from duocell.service.schemas.resources import Health, ProblemDocument, ProblemKind, Readiness

router = APIRouter(tags=["service"])

PROBLEM = {"model": ProblemDocument}
ProblemCode = Annotated[str, Path(description="`code` of a problem.", examples=["queue-full"])]


@router.get(
    "/healthz",
    operation_id="get_health",
    summary="Is the process alive?",
    response_model=None,
    responses={200: {"model": Health, "description": "It is."}},
)
async def get_health() -> Response:
    """Answers as long as the process does; looks at nothing else."""
    return JSONResponse({"status": "ok", "version": package_version()})


@router.get(
    "/readyz",
    operation_id="get_readiness",
    summary="Can the service solve?",
    response_model=None,
    responses={200: {"model": Readiness, "description": "It can."}, 503: PROBLEM},
)
async def get_readiness(state: StateOf) -> Response:
    """Whether the store was written a few seconds ago, workers live, and a self-test solve is at most 30 s old."""
    problem = state.jobs.store_problem
    checks = {"store": {"ok": not problem, "detail": problem}, **state.monitor.report()}
    failed = [name for name, check in checks.items() if not check["ok"]]
    if failed:
        why = "; ".join(f"{name}: {checks[name].get('detail') or 'fails'}" for name in failed)
        raise Problem("not-ready", why, headers={"Retry-After": "1"})
    return JSONResponse({"status": "ready", "checks": checks})


@router.get(
    "/problems/{code}",
    operation_id="get_problem",
    summary="What does a problem mean?",
    response_model=None,
    responses={200: {"model": ProblemKind, "description": "It means this."}, 404: PROBLEM},
)
async def get_problem(
    code: ProblemCode,
) -> Response:
    """Explains the `type` of an error answer."""
    if code not in KINDS:
        raise Problem("not-found", f"There is no kind of problem called {code[:80]!r}; known are {', '.join(KINDS)}.")
    return JSONResponse({"code": code, **asdict(KINDS[code])})
