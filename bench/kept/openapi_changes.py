"""What an OpenAPI document has lost against an older one: ``python -m bench.kept.openapi_changes OLD NEW``.

What an old client relies on must be there and mean the same; whatever else is there is an addition. References are
followed, so that it does not matter which schemas have names; but names that are gone are told, for clients are made
from them. Wording may change, but not vanish. The tools that do this are written in Go or have a single user.

In a request a field must not become required, in an answer it must not cease to be; values of an enumeration, members
of a union, responses, parameters and fields may be added anywhere. An answer may promise more of a text, its format,
where a request may not ask for more.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

WORDS = frozenset({"description", "summary", "title", "example", "examples"})
"""May be put otherwise."""
MAPS = frozenset(
    {"paths", "properties", "responses", "content", "headers", "links", "securitySchemes", "schemas", "mapping"}
)
"""Keywords whose members have names of their own."""
LIMITS = frozenset(
    {
        *("type", "enum", "const", "format", "pattern", "items", "additionalProperties", "multipleOf"),
        *("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "minLength", "maxLength", "minItems"),
        *("maxItems", "uniqueItems", "minProperties", "maxProperties", "anyOf", "oneOf", "allOf", "not", "required"),
        *("contentMediaType", "security"),
    }
)
"""Keywords that take something away where they are added."""
PROMISES = frozenset({"required", "format"})
"""Those among them that give something where they are added to an answer."""
SAME = {"example": "examples"}
"""Two keywords for one thing, of which only one may be there."""
UNIONS = frozenset({"anyOf", "oneOf", "allOf"})


@dataclass(slots=True)
class Changes:
    """What became of a document.

    Attributes:
        lost: what is gone or means something else, with its place.
        added: what is new.
    """

    lost: list[str] = field(default_factory=list)
    added: list[str] = field(default_factory=list)


def changes(old: Any, new: Any) -> Changes:
    """What became of an OpenAPI document."""
    found = _Comparison(old, new)
    for name in old["components"].get("schemas", {}):
        if name not in new["components"].get("schemas", {}):
            found.changes.lost.append(f"#/components/schemas/{name} is gone")
    found.names(old["paths"], new["paths"], "#/paths")
    ours, theirs = (document["components"].get("securitySchemes", {}) for document in (old, new))
    found.names(ours, theirs, "#/components/securitySchemes")
    return found.changes


class _Comparison:
    """The walk through two documents; ``request`` is True below the body and the parameters of a request."""

    def __init__(self, old: Any, new: Any) -> None:
        self.changes = Changes()
        self._documents = old, new
        self._under_way: set[tuple[str, str, bool]] = set()

    def names(self, old: Any, new: Any, place: str, request: bool = False) -> None:
        """Objects whose members have names."""
        for name, value in old.items():
            below = f"{place}/{_escaped(name)}"
            if name not in new:
                self.changes.lost.append(f"{below} is gone")
            else:
                self.node(value, new[name], below, request)
        self.changes.added += [f"{place}/{_escaped(name)}" for name in new if name not in old]

    def node(self, old: Any, new: Any, place: str, request: bool) -> None:
        """Objects whose members are keywords, and what they hold."""
        if not isinstance(old, dict) or not isinstance(new, dict):
            if old != new:
                self.changes.lost.append(f"{place}: {_short(old)} became {_short(new)}")
            return
        pair = (old.get("$ref", ""), new.get("$ref", ""), request)
        if all(pair[:2]) and pair in self._under_way:
            return
        self._under_way.add(pair)
        old, new = (self._followed(one, document) for one, document in zip((old, new), self._documents, strict=True))
        union = next((keyword for keyword in ("anyOf", "oneOf") if keyword in new), None)
        if union is not None and not UNIONS & old.keys():  # what was the only choice is one of several now
            old = {union: [{keyword: value for keyword, value in old.items() if keyword not in WORDS}]}
        for keyword, value in old.items():
            if keyword in new:
                inside = request or keyword in ("requestBody", "parameters")
                self._keyword(keyword, value, new[keyword], f"{place}/{_escaped(keyword)}", inside)
            elif value != [] and SAME.get(keyword) not in new:
                self.changes.lost.append(f"{place}/{_escaped(keyword)} is gone")
        for keyword in sorted(new.keys() - old.keys()):
            harmless = keyword not in LIMITS or (keyword in PROMISES and not request)
            (self.changes.added if harmless else self.changes.lost).append(f"{place}/{_escaped(keyword)} is new")
        self._under_way.discard(pair)

    def _keyword(self, keyword: str, old: Any, new: Any, place: str, request: bool) -> None:
        if keyword in WORDS:
            return
        if keyword in MAPS:
            self.names(old, new, place, request)
        elif keyword == "required" and isinstance(old, list):
            wrong = set(new) - set(old) if request else set(old) - set(new)
            what = "is required now" if request else "is no longer always there"
            self.changes.lost += [f"{place}: {name} {what}" for name in sorted(wrong)]
        elif keyword in ("enum", "tags"):
            self.changes.lost += [f"{place}: {_short(value)} is gone" for value in old if value not in new]
            self.changes.added += [f"{place}: {_short(value)}" for value in new if value not in old]
        elif keyword in UNIONS:
            self._members(old, new, place, request)
        elif keyword == "parameters" and isinstance(old, list):
            self._parameters(old, new, place)
        elif keyword == "type":
            if _as_set(old) != _as_set(new):
                self.changes.lost.append(f"{place}: {_short(old)} became {_short(new)}")
        else:
            self.node(old, new, place, request)

    def _members(self, old: list[Any], new: list[Any], place: str, request: bool) -> None:
        """Unions: every old member must be among the new ones, wherever."""
        left = list(enumerate(new))
        for index, member in enumerate(old):
            trials = [(self._trial(member, other, place, request), number) for number, other in left]
            if not trials:
                self.changes.lost.append(f"{place}/{index} is gone")
                continue
            best, number = min(trials, key=lambda trial: (len(trial[0].lost), len(trial[0].added)))
            self.changes.lost += best.lost
            self.changes.added += best.added
            left = [(k, other) for k, other in left if k != number]
        self.changes.added += [f"{place}/{number}" for number, _ in left]

    def _trial(self, old: Any, new: Any, place: str, request: bool) -> Changes:
        """What the difference of two members would be."""
        kept, self.changes = self.changes, Changes()
        self.node(old, new, f"{place}/*", request)
        kept, self.changes = self.changes, kept
        return kept

    def _parameters(self, old: list[Any], new: list[Any], place: str) -> None:
        ours, theirs = (
            {f"{one['in']} {one['name']}": one for one in (self._followed(p, document) for p in parameters)}
            for parameters, document in zip((old, new), self._documents, strict=True)
        )
        self.names(ours, theirs, place, request=True)
        asked = [name for name, one in theirs.items() if name not in ours and one.get("required")]
        self.changes.lost += [f"{place}: {name} is required now" for name in asked]

    def _followed(self, node: Any, document: Any) -> Any:
        """What a reference leads to, with what stands beside it; wording beside it is no matter."""
        while "$ref" in node:
            target = document
            for part in node["$ref"].removeprefix("#/").split("/"):
                target = target[part.replace("~1", "/").replace("~0", "~")]
            node = {**target, **{key: value for key, value in node.items() if key != "$ref"}}
        return node


def _as_set(value: Any) -> set[str]:
    return set(value) if isinstance(value, list) else {value}


def _escaped(name: str) -> str:
    return name.replace("~", "~0").replace("/", "~1")


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:59] + "…"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what is new and what is lost; 1 if anything is lost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", type=Path, help="a document as it was")
    parser.add_argument("new", type=Path, help="and as it is")
    given = parser.parse_args(arguments)
    old, new = (json.loads(path.read_text(encoding="utf-8")) for path in (given.old, given.new))
    found = changes(old, new)
    print("\n".join(_lines(found)))
    return 1 if found.lost else 0


def _lines(found: Changes) -> Iterator[str]:
    yield from (f"new   {one}" for one in found.added)
    yield from (f"LOST  {one}" for one in found.lost)
    yield f"{len(found.added)} additions, {len(found.lost)} losses"


if __name__ == "__main__":
    raise SystemExit(main())
