"""The OpenAPI document: what FastAPI derives from the endpoints, completed with what it cannot know."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel

from duocell.service.common.problems import MEDIA_TYPE
from duocell.service.http.idempotency import PATTERN
from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE
from duocell.service.schemas.request import EXAMPLE
from duocell.service.schemas.uploads import MeshUpload, RobotUpload

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
UNGUARDED = frozenset({"get_health", "get_readiness"})
"""Operations that neither ask for a key nor count requests."""
GUARDED_WITH = ("401", "429")
PROBLEMS = {
    "400": "The body is no JSON document.",
    "401": "The service asks for a key and there is none, or an unknown one.",
    "403": "It belongs to everybody, and is not deleted for one key.",
    "404": "There is nothing of that name.",
    "409": "Not in its present state: it is in use, has ended, or is being taken in already.",
    "413": "The body is too large.",
    "415": "The body is something else than JSON.",
    "422": "The request cannot be carried out; `errors` says why.",
    "429": "Too many requests, or too many layouts are waiting.",
    "500": "An error of the service.",
    "503": "The service cannot do it at the moment.",
}
"""What an error status means; the standard's phrases differ from one Python to the next."""

HEADERS: dict[str, dict[str, Any]] = {
    "Location": {"description": "Address of the resource.", "schema": {"type": "string"}},
    "ETag": {"description": "Changes whenever the layout does.", "schema": {"type": "string"}},
    "Retry-After": {"description": "Seconds after which to ask again.", "schema": {"type": "integer"}},
    "Link": {"description": 'The next page, `rel="next"`, if there is one.', "schema": {"type": "string"}},
    "Preference-Applied": {"description": "What was granted (RFC 7240).", "schema": {"type": "string"}},
    "WWW-Authenticate": {"description": "How to send a key (RFC 6750).", "schema": {"type": "string"}},
    "X-Request-ID": {"description": "The request's name in the log of the service.", "schema": {"type": "string"}},
    "RateLimit-Policy": {
        "description": "Requests `q` that are allowed in `w` seconds, if they are limited.",
        "schema": {"type": "string"},
    },
    "RateLimit": {
        "description": "Requests `r` that are left, and the seconds `t` until all of them are.",
        "schema": {"type": "string"},
    },
}
SENT_WITH: dict[tuple[str, str], list[str]] = {
    ("create_layout", "200"): ["Location", "ETag", "Preference-Applied"],
    ("create_layout", "202"): ["Location", "ETag", "Retry-After", "Preference-Applied"],
    ("create_robot", "201"): ["Location"],
    ("create_robot", "202"): ["Location", "Retry-After", "Preference-Applied"],
    ("get_import", "200"): ["Retry-After"],
    ("create_mesh", "200"): ["Location"],
    ("create_mesh", "201"): ["Location"],
    ("create_layout", "409"): ["Retry-After"],
    ("list_layouts", "200"): ["Link"],
    ("cancel_layout", "202"): ["ETag"],
    ("get_layout", "200"): ["ETag", "Retry-After"],
    ("get_layout", "304"): ["ETag"],
}
SENT_WITH_STATUS = {"401": ["WWW-Authenticate"], "429": ["Retry-After"], "503": ["Retry-After"]}
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
            "description": "1 to 255 printable ASCII characters, in quotes or not, best a new UUID: the same body with "
            "the same key is carried out once, however often it is sent.",
            "schema": {"type": "string", "pattern": PATTERN},
            "example": "8e03978e-40d5-43dd-bc93-6894a57f9324",
        },
    ],
    "create_robot": [
        {
            "name": "Prefer",
            "in": "header",
            "required": False,
            "description": "`respond-async`: answer as soon as the files are there, with the address to follow.",
            "schema": {"type": "string"},
            "example": "respond-async",
        }
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


def _form(model: type[BaseModel]) -> dict[str, Any]:
    """A form."""
    content = {"schema": {"$ref": f"#/components/schemas/{model.__name__}"}}
    return {"required": True, "description": str(model.__doc__), "content": {"multipart/form-data": content}}


FORMS: dict[str, type[BaseModel]] = {"create_robot": RobotUpload, "create_mesh": MeshUpload}
BODIES = {
    "create_layout": _body("The task, the arms, and where their bases may stand.", "LayoutRequest", EXAMPLE),
    "evaluate_layout": _body("The task, the arms, and where their bases stand.", "EvaluateRequest", EVALUATE_EXAMPLE),
    **{name: _form(form) for name, form in FORMS.items()},
}
LAYOUT_LINKS = {
    operation: {"operationId": operation, "parameters": {"layout_id": "$response.body#/id"}}
    for operation in ("get_layout", "follow_layout", "cancel_layout", "delete_layout")
}
"""What may be asked about a layout that was taken in."""
TAGS = [
    {"name": "layouts", "description": "Ask for layouts and fetch them."},
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
    """Bodies, headers and media types that FastAPI does not know of."""
    for path in schema["paths"].values():
        for operation in path.values():
            _complete(operation)
    for form in FORMS.values():
        schema["components"]["schemas"][form.__name__] = form.model_json_schema()
    schema["components"]["headers"] = HEADERS
    schema["components"]["securitySchemes"] = SECURITY
    schema["security"] = [{}, *({name: []} for name in SECURITY)]
    for unused in ("HTTPValidationError", "ValidationError"):
        schema["components"]["schemas"].pop(unused, None)
    return schema


def _complete(operation: dict[str, Any]) -> None:
    """One operation."""
    name = operation["operationId"]
    if name in BODIES:
        operation["requestBody"] = BODIES[name]
    operation.setdefault("parameters", []).extend(ASKED_WITH.get(name, []))
    guarded = name not in UNGUARDED
    responses = operation["responses"]
    if guarded:
        responses |= {status: _problem(PROBLEMS[status]) for status in GUARDED_WITH}
    for status in list(responses):
        reference = responses[status].get("content", {}).get("application/json", {}).get("schema", {}).get("$ref", "")
        if reference.endswith("/HTTPValidationError"):
            del responses[status]  # FastAPI expects that any parameter may be wrong; ours are strings
            continue
        if reference.endswith("/ProblemDocument"):
            responses[status] = _problem(PROBLEMS.get(status, responses[status]["description"]))
        if name == "create_layout" and status in ("200", "202"):
            responses[status]["links"] = LAYOUT_LINKS
        headers = [*SENT_WITH.get((name, status), []), *SENT_WITH_STATUS.get(status, []), "X-Request-ID"]
        headers += ["RateLimit-Policy", "RateLimit"] if guarded else []
        responses[status]["headers"] = {header: {"$ref": f"#/components/headers/{header}"} for header in headers}


def _problem(description: str) -> dict[str, Any]:
    """A response that is a problem."""
    schema = {"$ref": "#/components/schemas/ProblemDocument"}
    return {"description": description, "content": {MEDIA_TYPE: {"schema": schema}}}
