"""Problem documents (RFC 9457): the one form of every error answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from fastapi.responses import JSONResponse

from duocell.service.common.issues import MOST_SHOWN, Issue

MEDIA_TYPE = "application/problem+json"


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of problem: HTTP status, title, and what to do about it in general."""

    status: int
    title: str
    advice: str


_CHECK = "Each entry of `errors` points to the place and says what is allowed there."
KINDS: dict[str, Kind] = {
    "invalid-json": Kind(400, "The body is no JSON document", "Send one JSON object, encoded as UTF-8."),
    "invalid-form": Kind(400, "The body is no form", "Send `multipart/form-data`, as `curl -F` does."),
    "bad-request": Kind(400, "The request cannot be read", "See the detail."),
    "unauthorized": Kind(401, "A key is needed", "Send one in the header Authorization or X-API-Key."),
    "not-found": Kind(404, "There is nothing here", "Check the address; `/docs` lists all of them."),
    "layout-not-found": Kind(404, "No such layout", "Finished layouts are forgotten after a while: ask again."),
    "export-not-found": Kind(404, "No such export", "The detail lists all of them."),
    "nothing-to-export": Kind(409, "The layout has nothing of the kind", "Ask for another file, or see the reasons."),
    "layout-active": Kind(409, "The layout is under way", "Cancel it first, or wait until it is finished."),
    "layout-finished": Kind(409, "The layout is finished", "Only a queued or running layout can be cancelled."),
    "idempotency-key-busy": Kind(409, "The same request is being taken in", "Try again after Retry-After."),
    "idempotency-key-reused": Kind(
        422, "The Idempotency-Key belongs to another request", "Take a new key for every new request."
    ),
    "belongs-to-all": Kind(
        403, "What belongs to everybody is not deleted for one key", "Ask the operator to delete it."
    ),
    "robot-not-found": Kind(404, "No such robot", "`GET /v1/robots` lists all of them."),
    "import-not-found": Kind(404, "No such upload", "`GET /v1/robots` lists what was finished."),
    "mesh-not-found": Kind(404, "No such mesh", "`GET /v1/meshes` lists all of them."),
    "too-slow": Kind(408, "The body did not arrive in time", "Send it again."),
    "robot-exists": Kind(409, "Another robot has this name", "Choose another name, or delete that robot first."),
    "catalogue-robot": Kind(409, "The name belongs to the catalogue", "Robots of the catalogue stay as they are."),
    "too-many-kept": Kind(409, "Too many uploads are kept", "Delete some that are not needed any more."),
    "method-not-allowed": Kind(405, "This address does not know that method", "The header Allow lists what it knows."),
    "body-too-large": Kind(413, "The body is too large", "Send fewer poses, or raise DUOCELL_MAX_BODY."),
    "upload-too-large": Kind(413, "The upload is too large", "Simplify the meshes, or raise DUOCELL_MAX_UPLOAD."),
    "not-a-form": Kind(415, "The body must be a form", "Send `multipart/form-data`, as `curl -F` does."),
    "unsupported-media-type": Kind(415, "The body must be JSON", "Send the header `Content-Type: application/json`."),
    "invalid-request": Kind(422, "The request cannot be carried out", _CHECK),
    "invalid-input": Kind(422, "The request holds a value that cannot be used", _CHECK),
    "invalid-rotation": Kind(422, "An orientation is no rotation", _CHECK),
    "invalid-task": Kind(422, "The task defines no path", _CHECK),
    "invalid-robot": Kind(422, "The robot cannot be used", _CHECK),
    "unknown-robot": Kind(422, "No such robot", "`GET /v1/robots` lists all of them."),
    "unknown-mesh": Kind(422, "No such mesh", "`GET /v1/meshes` lists all of them; upload it with `POST /v1/meshes`."),
    "invalid-upload": Kind(422, "The upload cannot be used", _CHECK),
    "too-large": Kind(422, "The request asks for too much", _CHECK + " The limits are settings of the service."),
    "evaluations-full": Kind(
        429, "Too many evaluations at the same time", "Try again after the seconds of the header Retry-After."
    ),
    "queue-full": Kind(429, "Too many layouts are waiting", "Try again after the seconds of the header Retry-After."),
    "rate-limited": Kind(429, "Too many requests", "Try again after the seconds of the header Retry-After."),
    "uploads-full": Kind(429, "Too many uploads at once", "Try again after the seconds of the header Retry-After."),
    "error": Kind(500, "An error of the service", "Tell the operator; the log has the details."),
    "internal": Kind(500, "An error of the service", "Tell the operator; the log has the details."),
    "solver-failure": Kind(500, "An engine broke down", "Tell the operator; the log has the details."),
    "acceptance-failed": Kind(
        503, "The request could not be read in time", "Try again after the seconds of Retry-After; send less at a time."
    ),
    "evaluation-failed": Kind(
        503, "The layout could not be evaluated", "Try again; if it took too long, send fewer poses or coarser shapes."
    ),
    "uploads-unavailable": Kind(503, "Uploads cannot be read at the moment", "Try again; the log has the details."),
    "not-writable": Kind(503, "The data directory cannot be written", "Tell the operator; the log has the details."),
    "store-unavailable": Kind(
        503, "Jobs cannot be stored at the moment", "Nothing was changed; try again after the seconds of Retry-After."
    ),
    "closing": Kind(503, "The service is being stopped", "Try again after the seconds of the header Retry-After."),
    "not-ready": Kind(503, "The service is not ready", "Try again after the seconds of the header Retry-After."),
}
"""All kinds by code; codes of `duocell.models.base.errors` included."""

BY_STATUS = {
    400: "bad-request",
    404: "not-found",
    405: "method-not-allowed",
    413: "body-too-large",
    415: "unsupported-media-type",
    422: "invalid-request",
}
"""Kinds of the errors that the framework raises with nothing but a status."""


class Problem(Exception):
    """An error answer, to be raised where it is found."""

    def __init__(
        self,
        code: str,
        detail: str,
        *,
        errors: Sequence[Issue] = (),
        more: int = 0,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        """An error answer.

        Args:
            code: its kind. detail: a sentence.
            errors: places and sentences, if several. more: how many others there are.
            headers: of the answer.
        """
        super().__init__(detail)
        self.code = code
        self.detail = detail
        self.errors = errors
        self.more = more
        self.headers = headers


def document(problem: Problem, instance: str, status: int = 0) -> dict[str, Any]:
    """A problem document; ``status`` if it differs from that of the kind."""
    kind = KINDS[problem.code]
    listed = [{"pointer": issue.pointer, "detail": issue.detail} for issue in problem.errors[:MOST_SHOWN]]
    more = len(problem.errors) - len(listed) + problem.more
    if more:
        listed.append({"pointer": "", "detail": f"{more} further problems are not listed. Correct these first."})
    return {
        "type": f"/problems/{problem.code}",
        "title": kind.title,
        "status": status or kind.status,
        "detail": problem.detail,
        "instance": instance,
        "code": problem.code,
        "errors": listed,
    }


def response(problem: Problem, instance: str, status: int = 0) -> JSONResponse:
    """The answer for a problem."""
    body = document(problem, instance, status)
    return JSONResponse(body, body["status"], dict(problem.headers or {}), media_type=MEDIA_TYPE)


def phrase(status: int) -> str:
    """The standard words for a status."""
    try:
        return HTTPStatus(status).phrase
    except ValueError:
        return "Error"
