"""JSON as RFC 8259 means it: no duplicate names, no NaN, no half characters."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, NoReturn

from duocell.service.common.issues import shortened

MOST_FIELDS = 1000
"""Of one object. No object of the contract has a tenth of it; what is made of them all is bounded by it."""


class NotJson(Exception):
    """A text that is no JSON document; ``detail`` says where and what to do, ``pointer`` where if that is known."""

    def __init__(self, detail: str) -> None:
        super().__init__(detail)
        self.detail = detail


def parse(body: bytes) -> Any:
    """The document in ``body``.

    Raises:
        NotJson: it holds none, or one that is ambiguous.
    """
    try:
        text = body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise NotJson(f"Byte {error.start} is no UTF-8. Send JSON encoded as UTF-8.") from error
    if not text.strip():
        raise NotJson("The body is empty. Send a JSON object.")
    try:
        document = json.loads(text, object_pairs_hook=_without_duplicates, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        raise NotJson(
            f"Not JSON at line {error.lineno}, column {error.colno}: {error.msg}. "
            "Check commas, quotes and brackets there."
        ) from error
    except RecursionError as error:
        raise NotJson("Brackets are nested too deeply; a request needs fewer than ten levels.") from error
    except ValueError as error:  # a number of thousands of digits
        raise NotJson(f"A number cannot be read: {error}.") from error
    _refuse_half_characters(text, document)
    return document


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object, if every name occurs once and there are not too many of them."""
    if len(pairs) > MOST_FIELDS:
        raise NotJson(
            f"An object has {len(pairs)} fields, {shortened(pairs[0][0])} first; none has more than {MOST_FIELDS} here."
        )
    members = dict(pairs)
    if len(members) < len(pairs):
        twice = shortened(_repeated(name for name, _ in pairs))
        raise NotJson(f"An object has the field {twice} more than once; which one counts? Remove the others.")
    return members


def _repeated(names: Iterable[str]) -> str:
    """The first name that has been there before."""
    known: set[str] = set()
    for name in names:
        if name in known:
            return name
        known.add(name)
    raise ValueError("every name is there once")


def _refuse_constant(name: str) -> NoReturn:
    """NaN, Infinity, -Infinity: Python reads them, JSON has no such numbers."""
    raise NotJson(f"{name} is no JSON number. Send finite numbers only; leave a field out or send null for no value.")


def _refuse_half_characters(text: str, document: Any) -> None:
    r"""Escapes such as \ud800 without their other half can be read but never be written again."""
    if "\\ud" not in text and "\\uD" not in text:
        return
    try:
        json.dumps(document, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError as error:
        raise NotJson("A string holds half a character (a lone \\ud800 to \\udfff). Send whole characters.") from error
