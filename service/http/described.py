"""What an endpoint says of itself in the OpenAPI document, beside what FastAPI reads from its signature.

Bodies are read in bounded pieces while they arrive, not by the framework, which takes in whatever comes: an endpoint
gets them by a dependency, and declares them with `json_body_of` and `form_body_of`. Answers whose text is stored as it
is sent are declared with `answer`, and so are the headers of all answers.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from duocell.service.common.problems import MEDIA_TYPE

PROBLEMS = {
    400: "The body is no JSON document.",
    401: "The service asks for a key and there is none, or an unknown one.",
    403: "It belongs to everybody, and is not deleted for one key.",
    404: "There is nothing of that name.",
    408: "The body did not arrive in time.",
    409: "Not in its present state: it is in use, has ended, or is being taken in already.",
    413: "The body is too large.",
    415: "The body is something else than JSON.",
    422: "The request cannot be carried out; `errors` says why.",
    429: "Too many requests, or too many layouts are waiting.",
    500: "An error of the service.",
    503: "The service cannot do it at the moment.",
}
"""What an error status means; the standard's phrases differ from one Python to the next."""

HEADERS: dict[str, dict[str, Any]] = {
    "Location": {"description": "Address of the resource.", "schema": {"type": "string"}},
    "ETag": {"description": "Changes whenever the layout does.", "schema": {"type": "string"}},
    "Retry-After": {"description": "Seconds after which to ask again.", "schema": {"type": "integer"}},
    "Content-Disposition": {"description": "A name for the file.", "schema": {"type": "string"}},
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
"""Headers of answers."""
SENT_WITH_STATUS: dict[int, tuple[str, ...]] = {
    401: ("WWW-Authenticate",),
    429: ("Retry-After",),
    503: ("Retry-After",),
}
"""Headers that errors have."""

Described = dict[str, Any]
"""Part of the document."""


def answer(
    description: str,
    *headers: str,
    model: type[BaseModel] | None = None,
    content: Mapping[str, Any] | None = None,
    links: Mapping[str, Any] | None = None,
) -> Described:
    """One entry of the ``responses`` of an endpoint.

    Args:
        description: when this is the answer.
        headers: names in `HEADERS` that it has.
        model: of its JSON. content: by media type, where it is none.
        links: what can be asked next.
    """
    given = {"model": model, "content": content, "links": links}
    return {
        "description": description,
        "headers": {name: header(name) for name in headers},
        **{keyword: value for keyword, value in given.items() if value is not None},
    }


def problems(*statuses: int, headers: Mapping[int, tuple[str, ...]] | None = None) -> dict[int | str, Described]:
    """Entries of the ``responses`` of an endpoint for errors.

    Args:
        statuses: that it may answer with.
        headers: by status, beside those that all errors of that status have.
    """
    content = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/ProblemDocument"}}}
    return {
        status: answer(
            PROBLEMS[status], *(headers or {}).get(status, ()), *SENT_WITH_STATUS.get(status, ()), content=content
        )
        for status in statuses
    }


def header(name: str) -> Described:
    """A header, by reference."""
    return {"$ref": f"#/components/headers/{name}"}


def json_body_of(model: type[BaseModel], description: str, example: Mapping[str, Any]) -> Described:
    """``openapi_extra`` of an endpoint that takes JSON."""
    examples = {"line": {"summary": example["name"], "value": example}}
    return _body(description, "application/json", {"schema": _schema(model), "examples": examples})


def form_body_of(model: type[BaseModel]) -> Described:
    """``openapi_extra`` of an endpoint that takes a form."""
    return _body(str(model.__doc__), "multipart/form-data", {"schema": _schema(model)})


def _body(description: str, media_type: str, content: Described) -> Described:
    return {"requestBody": {"required": True, "description": description, "content": {media_type: content}}}


def _schema(model: type[BaseModel]) -> Described:
    """The schema with all that it refers to; `named` moves both to where references look."""
    return {NAME: model.__name__, **model.model_json_schema(ref_template="#/components/schemas/{model}")}


NAME = "x-name"
"""Keyword that a schema carries until it is where its name is known."""


def named(operation: Described, schemas: Described) -> None:
    """Move the schema of an operation's body to the schemas that have names, and refer to it."""
    if "requestBody" not in operation:
        return
    operation["requestBody"] = copy.deepcopy(operation["requestBody"])  # it is the endpoint's own until here
    for content in operation["requestBody"]["content"].values():
        schema = content["schema"]
        name = schema.pop(NAME)
        for other, inner in schema.pop("$defs", {}).items():
            schemas.setdefault(other, inner)
        schemas.setdefault(name, schema)
        content["schema"] = {"$ref": f"#/components/schemas/{name}"}


def not_sent() -> list[str]:
    """The values of a header that was not sent: a default factory.

    Not `list` itself: whenever one is asked for, Pydantic finds out what arguments it takes, and for what is built in
    that takes a millisecond.
    """
    return []
