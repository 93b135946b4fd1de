"""Results that older versions have stored: their words and versions stay, what they did not tell becomes null."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

NEWEST = '"warnings":'
"""The newest field; a quotation mark inside of a text is escaped, so that this can only be the name of a field."""


def completed(result: str) -> str:
    """JSON of a stored result with the fields that tell what its word means; that of a result of this version as it is.

    What results of even older versions lack beside these stays out.
    """
    if NEWEST in result:
        return result
    document: dict[str, Any] = json.loads(result)
    document.setdefault("warnings", [])
    _fill(document["search"], "ended", "first_feasible_time")
    if document.get("certificate") is not None:
        _fill(document["certificate"], "ended")
    for arm in _arms(document):
        _fill(arm, "singularities")
    return json.dumps(document, allow_nan=False)


def _arms(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The arms of the layout, and those of the alternatives."""
    yield from document["arms"]
    for alternative in document.get("alternatives", []):
        yield from alternative["arms"]


def _fill(part: dict[str, Any], *names: str) -> None:
    """Add what is missing."""
    for name in names:
        part.setdefault(name, None)
