"""The OpenAPI document: what FastAPI derives from the endpoints, completed with what it cannot know."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from service.problems import MEDIA_TYPE
from service.schemas.evaluate import EVALUATE_EXAMPLE
from service.schemas.request import EXAMPLE

DESCRIPTION = """\
Where should the arms of a workcell be bolted down? Send the poses that a part goes through and the arms that carry it;
the answer is the base placements that keep all joints nearest to their references, within limits and without a change
of posture, verified independently and on request proved to be the best.

SI units and radians throughout. Errors are `application/problem+json` (RFC 9457).
"""

HEADERS: dict[str, dict[str, Any]] = {
    "Location": {"description": "Address of the layout.", "schema": {"type": "string"}},
    "ETag": {"description": "Changes whenever the layout does.", "schema": {"type": "string"}},
    "Retry-After": {"description": "Seconds after which to ask again.", "schema": {"type": "integer"}},
    "Link": {"description": 'The next page, `rel="next"`, if there is one.', "schema": {"type": "string"}},
    "Preference-Applied": {"description": "The wait that was granted (RFC 7240).", "schema": {"type": "string"}},
}
SENT_WITH: dict[tuple[str, str], list[str]] = {
    ("create_layout", "200"): ["Location", "ETag", "Preference-Applied"],
    ("create_layout", "202"): ["Location", "ETag", "Retry-After", "Preference-Applied"],
    ("create_layout", "409"): ["Retry-After"],
    ("create_layout", "429"): ["Retry-After"],
    ("evaluate_layout", "429"): ["Retry-After"],
    ("evaluate_layout", "503"): ["Retry-After"],
    ("create_layout", "503"): ["Retry-After"],
    ("list_layouts", "200"): ["Link"],
    ("cancel_layout", "202"): ["ETag"],
    ("get_layout", "200"): ["ETag", "Retry-After"],
    ("get_layout", "304"): ["ETag"],
    ("get_readiness", "503"): ["Retry-After"],
}
ASKED_WITH: dict[str, list[dict[str, Any]]] = {
    "create_layout": [
        {
            "name": "Prefer",
            "in": "header",
            "required": False,
            "description": "`wait=N`: answer with the finished layout if it is done within N seconds (RFC 7240).",
            "schema": {"type": "string"},
            "example": "wait=10",
        },
        {
            "name": "Idempotency-Key",
            "in": "header",
            "required": False,
            "description": "1 to 255 printable ASCII characters, best a new UUID: the same body with the same key is "
            "carried out once, however often it is sent.",
            "schema": {"type": "string"},
            "example": "8e03978e-40d5-43dd-bc93-6894a57f9324",
        },
    ],
    "follow_layout": [
        {
            "name": "Last-Event-ID",
            "in": "header",
            "required": False,
            "description": "id of the last event received: the stream goes on behind it.",
            "schema": {"type": "string"},
        }
    ],
    "get_layout": [
        {
            "name": "If-None-Match",
            "in": "header",
            "required": False,
            "description": "ETag of the answer before; the answer is 304 while nothing has changed.",
            "schema": {"type": "string"},
        }
    ],
}


def _body(description: str, schema: str, example: dict[str, Any]) -> dict[str, Any]:
    """A JSON body."""
    content = {
        "schema": {"$ref": f"#/components/schemas/{schema}"},
        "examples": {"line": {"summary": example["name"], "value": example}},
    }
    return {"required": True, "description": description, "content": {"application/json": content}}


BODIES = {
    "create_layout": _body("The task, the arms, and where their bases may stand.", "LayoutRequest", EXAMPLE),
    "evaluate_layout": _body("The task, the arms, and where their bases stand.", "EvaluateRequest", EVALUATE_EXAMPLE),
}
TAGS = [
    {"name": "layouts", "description": "Ask for layouts and fetch them."},
    {"name": "robots", "description": "The robots that a request may name."},
    {"name": "service", "description": "Health of the service, meaning of its problems."},
]


def install(app: FastAPI) -> None:
    """Make ``app.openapi()`` answer with the completed document."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            schema = get_openapi(
                title=app.title,
                version=app.version,
                summary="Base placements for the arms of a workcell.",
                description=DESCRIPTION,
                routes=app.routes,
                tags=TAGS,
                license_info={"name": "BSD-3-Clause", "identifier": "BSD-3-Clause"},
                separate_input_output_schemas=False,
            )
            app.openapi_schema = completed(schema)
        return app.openapi_schema

    app.openapi = document  # type: ignore[method-assign]


def completed(schema: dict[str, Any]) -> dict[str, Any]:
    """Bodies, headers and media types that FastAPI does not know of."""
    for path in schema["paths"].values():
        for operation in path.values():
            _complete(operation)
    for unused in ("HTTPValidationError", "ValidationError"):
        schema["components"]["schemas"].pop(unused, None)
    return schema


def _complete(operation: dict[str, Any]) -> None:
    """One operation."""
    name = operation["operationId"]
    if name in BODIES:
        operation["requestBody"] = BODIES[name]
    operation.setdefault("parameters", []).extend(ASKED_WITH.get(name, []))
    responses = operation["responses"]
    for status in list(responses):
        content = responses[status].get("content", {})
        reference = content.get("application/json", {}).get("schema", {}).get("$ref", "")
        if reference.endswith("/HTTPValidationError"):
            del responses[status]  # FastAPI expects that any parameter may be wrong; ours are strings
            continue
        if reference.endswith("/ProblemDocument"):
            content[MEDIA_TYPE] = content.pop("application/json")
        headers = {header: HEADERS[header] for header in SENT_WITH.get((name, status), [])}
        if headers:
            responses[status]["headers"] = headers
