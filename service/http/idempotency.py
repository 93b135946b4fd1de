"""The request header Idempotency-Key."""

from __future__ import annotations

import re
from typing import Annotated

from fastapi import Depends, Header
from pydantic import WithJsonSchema

from duocell.service.common.issues import Issue
from duocell.service.common.problems import Problem
from duocell.service.http.described import not_sent

BARE, QUOTED = "[!#-~]([ -~]{0,253}[!-~])?", '"[!-~]([ -~]{0,253}[!-~])?"'
PATTERN = f"^({BARE}|{QUOTED})$"
"""What is accepted, as the document says it: printable ASCII, no spaces at the ends."""

_KEY = re.compile(PATTERN)


def key_of(headers: list[str]) -> str | None:
    """The key that a client has given its request, or None.

    The drafts of the header want a quoted string, most clients send a bare one: quotes around it are left away.

    Raises:
        Problem: there are two keys, or one that cannot be used.
    """
    if not headers:
        return None
    key = headers[0].strip()
    if len(headers) > 1 or _KEY.fullmatch(key) is None:
        detail = "Idempotency-Key must be given once, with 1 to 255 printable ASCII characters. A UUID is a good one."
        raise Problem("bad-request", detail, errors=[Issue("", detail)])
    return key[1:-1] if key.startswith('"') else key


_Sent = Annotated[
    list[str],
    Header(
        alias="Idempotency-Key",
        default_factory=not_sent,
        description="1 to 255 printable ASCII characters, in quotes or not, best a new UUID: the same body with the "
        "same key is carried out once, however often it is sent.",
        openapi_examples={"uuid": {"value": "8e03978e-40d5-43dd-bc93-6894a57f9324"}},
    ),
    WithJsonSchema({"type": "string", "pattern": PATTERN}),
]


async def _key(sent: _Sent) -> str | None:
    return key_of(sent)


IdempotencyKey = Annotated[str | None, Depends(_key)]
"""See `key_of`."""
