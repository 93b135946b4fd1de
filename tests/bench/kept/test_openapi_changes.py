"""What the comparison of OpenAPI documents calls lost, on small documents and on our own."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bench.kept.openapi_changes import changes

ROOT = Path(__file__).parents[3]
Document = dict[str, Any]

ARM: Document = {
    "type": "object",
    "description": "An arm.",
    "properties": {
        "name": {"type": "string", "description": "Its name."},
        "kind": {"enum": ["a", "b"]},
        "next": {"anyOf": [{"$ref": "#/components/schemas/Arm"}, {"type": "null"}]},
    },
    "required": ["name"],
}
DOCUMENT: Document = {
    "paths": {
        "/arms": {
            "post": {
                "tags": [],
                "parameters": [
                    {"in": "query", "name": "limit", "schema": {"type": "integer", "maximum": 100}, "example": 5}
                ],
                "requestBody": {"content": {"application/json": {"schema": {"$ref": "#/components/schemas/Arm"}}}},
                "responses": {
                    "200": {"content": {"application/json": {"schema": {"$ref": "#/components/schemas/Arm"}}}},
                    "201": {"content": {"text/plain": {"schema": {"type": "string"}}}},
                },
            }
        }
    },
    "components": {"schemas": {"Arm": ARM}},
}


def arm(document: Document) -> Document:
    found: Document = document["components"]["schemas"]["Arm"]
    return found


def operation(document: Document) -> Document:
    found: Document = document["paths"]["/arms"]["post"]
    return found


def both(document: Document) -> None:
    """The name of a schema is there, but nothing refers to it: the operations say it themselves."""
    body = copy.deepcopy(arm(document))
    operation(document)["requestBody"]["content"]["application/json"]["schema"] = body
    operation(document)["responses"]["200"]["content"]["application/json"]["schema"] = body


ALLOWED: dict[str, Callable[[Document], Any]] = {
    "nothing": lambda d: None,
    "a path": lambda d: d["paths"].update({"/legs": {"get": {}}}),
    "a field": lambda d: arm(d)["properties"].update(mass={"type": "number"}),
    "another value": lambda d: arm(d)["properties"]["kind"]["enum"].append("c"),
    "another member of a union": lambda d: arm(d)["properties"]["next"]["anyOf"].insert(0, {"type": "string"}),
    "a choice where there was none": lambda d: arm(d)["properties"].update(
        name={"oneOf": [{"type": "integer"}, {"type": "string"}], "description": "Its name."}
    ),
    "other words": lambda d: arm(d).update(description="A robot arm."),
    "another order": lambda d: arm(d)["properties"]["next"]["anyOf"].reverse(),
    "schemas in place of references": both,
    "a parameter": lambda d: operation(d)["parameters"].append({"in": "query", "name": "from", "schema": {}}),
    "an example, put otherwise": lambda d: operation(d)["parameters"][0].update(
        examples={"few": {"value": operation(d)["parameters"][0].pop("example")}}
    ),
    "an empty list": lambda d: operation(d).pop("tags"),
    "the format of what is answered": lambda d: operation(d)["responses"]["201"]["content"]["text/plain"][
        "schema"
    ].update(format="date-time"),
    "a response": lambda d: operation(d)["responses"].update({"404": {}}),
}
LOST: dict[str, tuple[Callable[[Document], Any], str]] = {
    "a path": (lambda d: d["paths"].clear(), "#/paths/~1arms is gone"),
    "a method": (lambda d: d["paths"]["/arms"].clear(), "#/paths/~1arms/post is gone"),
    "a response": (lambda d: operation(d)["responses"].clear(), "responses/200 is gone"),
    "a field": (lambda d: arm(d)["properties"].pop("name"), "properties/name is gone"),
    "its explanation": (lambda d: arm(d)["properties"]["name"].pop("description"), "name/description is gone"),
    "a value": (lambda d: arm(d)["properties"]["kind"]["enum"].remove("a"), 'kind/enum: "a" is gone'),
    "a type": (lambda d: arm(d)["properties"]["name"].update(type="integer"), '"string" became "integer"'),
    "freedom": (lambda d: arm(d)["properties"]["name"].update(maxLength=3), "name/maxLength is new"),
    "a member of a union": (lambda d: arm(d)["properties"]["next"]["anyOf"].pop(), "next/anyOf/1 is gone"),
    "a parameter": (lambda d: operation(d)["parameters"].clear(), "query limit is gone"),
    "its example": (lambda d: operation(d)["parameters"][0].pop("example"), "query limit/example is gone"),
    "freedom in the format of what is sent": (
        lambda d: arm(d)["properties"]["name"].update(format="date-time"),
        "name/format is new",
    ),
    "a wider limit": (lambda d: operation(d)["parameters"][0]["schema"].update(maximum=10), "100 became 10"),
    "a field that may be left out": (lambda d: arm(d).update(required=["name", "kind"]), "kind is required now"),
    "a field that is always there": (lambda d: arm(d).update(required=[]), "name is no longer always there"),
    "a request without a parameter": (
        lambda d: operation(d)["parameters"].append({"in": "query", "name": "from", "required": True}),
        "query from is required now",
    ),
    "a name": (lambda d: d["components"]["schemas"].update(Robot=d["components"]["schemas"].pop("Arm")), ""),
}


@pytest.mark.parametrize("what", ALLOWED)
def test_additions_lose_nothing(what: str) -> None:
    new = copy.deepcopy(DOCUMENT)
    ALLOWED[what](new)
    assert changes(DOCUMENT, new).lost == []


@pytest.mark.parametrize("what", LOST)
def test_losses_are_told(what: str) -> None:
    spoil, words = LOST[what]
    new = copy.deepcopy(DOCUMENT)
    spoil(new)
    if what == "a name":
        text = json.dumps(new).replace("schemas/Arm", "schemas/Robot")
        assert changes(DOCUMENT, json.loads(text)).lost == ["#/components/schemas/Arm is gone"]
    else:
        assert any(words in one for one in changes(DOCUMENT, new).lost)


def test_our_own_document_has_lost_nothing() -> None:
    # What has to go is told in CHANGELOG.md; then docs/openapi.json is what is kept.
    kept, now = (
        json.loads((ROOT / path).read_text(encoding="utf-8"))
        for path in ("tests/data/openapi/kept.json", "docs/openapi.json")
    )
    assert changes(kept, now).lost == []
