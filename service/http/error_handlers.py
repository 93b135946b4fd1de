"""From exceptions to problem documents: what is raised on purpose.

The rest is for `duocell.service.http.middleware.unexpected`.
"""

from __future__ import annotations

import logging
from difflib import get_close_matches
from http import HTTPStatus

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from starlette.exceptions import HTTPException

from duocell.models.base.errors import DuocellError
from duocell.service.common.issues import MOST_OF_A_NAME, InvalidRequest, Issue, shortened
from duocell.service.common.job_errors import Refused, StoreUnavailable
from duocell.service.common.problems import BY_STATUS, KINDS, Problem, phrase, response
from duocell.service.common.routes import route_of
from duocell.service.validation.strict_json import NotJson

log = logging.getLogger(__name__)

KNOWN = (
    Problem,
    InvalidRequest,
    NotJson,
    Refused,
    StoreUnavailable,
    DuocellError,
    RequestValidationError,
    HTTPException,
)
STORE_RETRY_AFTER = 2
"""s; the store is looked at again about as often."""


def install(app: FastAPI) -> None:
    """Teach ``app`` to answer every exception with a problem."""

    def handle(request: Request, error: Exception) -> Response:
        problem, status = as_problem(error)
        if isinstance(error, DuocellError) and KINDS[problem.code].status >= 500:
            log.error("%s", error.detail, exc_info=error)
        if problem.code == "not-found" and isinstance(error, HTTPException):
            problem = Problem("not-found", _nearest(request), headers=error.headers)
        if status == HTTPStatus.METHOD_NOT_ALLOWED:
            problem.headers = dict(problem.headers or {}) | _allowed(request)
        return response(problem, request.url.path, status)

    for kind in KNOWN:
        app.add_exception_handler(kind, handle)


def as_problem(error: Exception) -> tuple[Problem, int]:
    """The problem of an exception, and its status where that is not the kind's own."""
    match error:
        case Problem():
            return error, 0
        case InvalidRequest():
            first, more = error.issues[0], len(error.issues) - 1 + error.more
            detail = f"{first.pointer or 'The body'}: {first.detail}" + (f" ({more} more)" if more else "")
            return Problem(error.code, detail, errors=error.issues, more=error.more), 0
        case NotJson():
            return Problem("invalid-json", error.detail, errors=[Issue("", error.detail)]), 0
        case Refused():
            return Problem(error.code, error.detail, headers=_retry_after(error.retry_after)), 0
        case StoreUnavailable():
            return Problem("store-unavailable", error.detail, headers=_retry_after(STORE_RETRY_AFTER)), 0
        case DuocellError():
            return Problem(error.code if error.code in KINDS else "error", error.detail), 0
        case RequestValidationError():
            issues = [
                Issue("", f"{'/'.join(map(str, e['loc']))}: {e['msg']}, got {shortened(e['input'])}.")
                for e in error.errors()
            ]
            return Problem("invalid-request", issues[0].detail, errors=issues), 0
        case HTTPException():
            return _framework_problem(error), error.status_code
    raise AssertionError(f"installed for {type(error).__name__} without a problem")


def _retry_after(seconds: int | None) -> dict[str, str]:
    return {} if seconds is None else {"Retry-After": str(seconds)}


def _framework_problem(error: HTTPException) -> Problem:
    """What FastAPI and Starlette raise on their own: unknown addresses and methods."""
    code = BY_STATUS.get(error.status_code, "internal" if error.status_code >= 500 else "bad-request")
    detail = KINDS[code].title if error.detail == phrase(error.status_code) else error.detail.rstrip(".")
    return Problem(code, f"{detail}. {KINDS[code].advice}", headers=error.headers)


def _allowed(request: Request) -> dict[str, str]:
    """All methods of an address; the framework names those of one route only, though several may share the address."""
    methods = request.app.openapi()["paths"].get(route_of(request.scope), {})
    names = {method.upper() for method in methods} | ({"HEAD"} if "get" in methods else set())
    return {"Allow": ", ".join(sorted(names))} if names else {}


def _nearest(request: Request) -> str:
    """What to say of an address that does not exist: where to look instead."""
    path = request.url.path[:MOST_OF_A_NAME].rstrip("/")
    known = [known for known in request.app.openapi()["paths"] if "{" not in known]
    near = [f"/v1{path}"] if f"/v1{path}" in known else get_close_matches(path, known, n=1)
    advice = f"Did you mean {near[0]}? " if near else ""
    return f"There is nothing at this address. {advice}`/docs` and `/openapi.json` list all of them."
