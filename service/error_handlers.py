"""From exceptions to problem documents; every error that leaves the service passes here."""

from __future__ import annotations

import logging

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from starlette.exceptions import HTTPException

from models.errors import DuocellError
from service.issues import InvalidRequest, Issue
from service.problems import BY_STATUS, KINDS, Problem, phrase, response
from service.refusals import Refused
from service.store.job_store import StoreUnavailable
from service.strict_json import NotJson

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
        return response(problem, request.url.path, status)

    for kind in KNOWN:
        app.add_exception_handler(kind, handle)
    app.add_exception_handler(Exception, handle)


def as_problem(error: Exception) -> tuple[Problem, int]:
    """The problem of an exception, and its status where that is not the kind's own."""
    match error:
        case Problem():
            return error, 0
        case InvalidRequest():
            first, more = error.issues[0], len(error.issues) - 1
            detail = f"{first.pointer or 'The body'}: {first.detail}" + (f" ({more} more)" if more else "")
            return Problem(error.code, detail, errors=error.issues), 0
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
                Issue("", f"{'/'.join(map(str, e['loc']))}: {e['msg']}, got {e['input']!r}.") for e in error.errors()
            ]
            return Problem("invalid-request", issues[0].detail, errors=issues), 0
        case HTTPException():
            return _framework_problem(error), error.status_code
    log.error("unexpected error", exc_info=error)
    return Problem("internal", "Something unexpected happened; the log of the server has the details."), 0


def _retry_after(seconds: int | None) -> dict[str, str]:
    return {} if seconds is None else {"Retry-After": str(seconds)}


def _framework_problem(error: HTTPException) -> Problem:
    """What FastAPI and Starlette raise on their own: unknown addresses and methods."""
    code = BY_STATUS.get(error.status_code, "internal" if error.status_code >= 500 else "bad-request")
    detail = KINDS[code].title if error.detail == phrase(error.status_code) else error.detail.rstrip(".")
    return Problem(code, f"{detail}. {KINDS[code].advice}", headers=error.headers)
