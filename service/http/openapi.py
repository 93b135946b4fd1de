"""The OpenAPI document: what FastAPI derives from the endpoints, completed with what middleware does."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from duocell.service.http.described import HEADERS, header, named, problems
from duocell.service.http.middleware.guard import ALWAYS_OPEN

DESCRIPTION = """\
Where should the arms of a workcell be bolted down? Send the poses that a part goes through and the arms that carry it;
the answer is the base placements that keep all joints nearest to their references, within limits and without a change
of posture, verified independently and on request proved to be the best.

SI units and radians throughout. Errors are `application/problem+json` (RFC 9457). Where the operator has set it so, a
key is needed, and requests per second are limited. Every answer has an `X-Request-ID`, yours if you send one: the name
of the request in the log of the service.
"""

SECURITY: dict[str, dict[str, Any]] = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "A key of the service, if it asks for one."},
    "apiKey": {
        "type": "apiKey",
        "in": "header",
        "name": "X-API-Key",
        "description": "The same where Authorization is taken, by a gateway say.",
    },
}
GUARDED_WITH = (401, 429)
"""Errors that the guard may answer with, whatever is asked for."""
TAGS = [
    {"name": "layouts", "description": "Ask for layouts and fetch them."},
    {"name": "tasks", "description": "Tasks from files: tables, robot programs, tool paths."},
    {"name": "robots", "description": "The robots that a request may name: built in, or brought by users."},
    {"name": "meshes", "description": "Solids brought by users, for obstacles, parts and tools."},
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
    """With what is said once for all endpoints: what middleware adds, keys, and the names of the schemas of bodies."""
    for path, item in schema["paths"].items():
        for operation in item.values():
            named(operation, schema["components"]["schemas"])
            _add_middleware(operation, guarded=path not in ALWAYS_OPEN)
    schema["components"]["headers"] = HEADERS
    schema["components"]["securitySchemes"] = SECURITY
    schema["security"] = [{}, *({name: []} for name in SECURITY)]
    for unused in ("HTTPValidationError", "ValidationError"):
        schema["components"]["schemas"].pop(unused, None)
    return schema


def _add_middleware(operation: dict[str, Any], *, guarded: bool) -> None:
    """Errors and headers that middleware answers with."""
    responses = operation["responses"]
    for status in list(responses):
        if "HTTPValidationError" in str(responses[status].get("content")):
            del responses[status]  # FastAPI expects that any parameter may be wrong; these are plain strings
    if guarded:
        responses |= {str(status): response for status, response in problems(*GUARDED_WITH).items()} | responses
    always = ("X-Request-ID", "RateLimit-Policy", "RateLimit") if guarded else ("X-Request-ID",)
    for response in responses.values():
        response["headers"] = response.get("headers", {}) | {name: header(name) for name in always}
