"""The request header Prefer (RFC 7240), as far as it concerns waiting, and not waiting."""

from __future__ import annotations

import re
from typing import Annotated

from fastapi import Header
from pydantic import WithJsonSchema

from duocell.service.http.described import not_sent

_ONE = WithJsonSchema({"type": "string"})
"""A header that may be sent several times is one text to a client."""
WaitPreference = Annotated[
    list[str],
    Header(
        alias="Prefer",
        default_factory=not_sent,
        description="`wait=N`: answer with the finished layout if it is done within N seconds (RFC 7240).",
        openapi_examples={"wait": {"value": "wait=10"}},
    ),
    _ONE,
]
AsyncPreference = Annotated[
    list[str],
    Header(
        alias="Prefer",
        default_factory=not_sent,
        description="`respond-async`: answer as soon as the files are there, with the address to follow.",
        openapi_examples={"async": {"value": "respond-async"}},
    ),
    _ONE,
]

_WAIT = re.compile(r"\s*wait\s*=\s*\"?(\d{1,9})\"?\s*", re.IGNORECASE)


def preferred_wait(headers: list[str], most: float) -> float | None:
    """Seconds a client is willing to wait, capped; None if it says nothing that can be understood.

    Args:
        headers: values of all Prefer headers; of repeated preferences the first counts.
        most: s, cap.
    """
    for preference in ",".join(headers).split(","):
        match = _WAIT.fullmatch(preference.split(";")[0])
        if match is not None:
            return min(float(match[1]), most)
    return None


def prefers_async(headers: list[str]) -> bool:
    """Whether a client would rather be told where to look than wait (``respond-async``).

    Args:
        headers: values of all Prefer headers.
    """
    preferences = (preference.split(";")[0] for preference in ",".join(headers).split(","))
    return any(preference.strip().lower() == "respond-async" for preference in preferences)
