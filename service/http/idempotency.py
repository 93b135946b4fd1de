"""The request header Idempotency-Key."""

from __future__ import annotations

import re

from duocell.service.common.issues import Issue
from duocell.service.common.problems import Problem

BARE, QUOTED = "[!#-~]([ -~]{0,253}[!-~])?", '"[!-~]([ -~]{0,253}[!-~])?"'
PATTERN = f"^({BARE}|{QUOTED})$"
"""What is accepted, as the document says it: printable ASCII, no spaces at the ends."""

_KEY = re.compile(PATTERN)


def idempotency_key(headers: list[str]) -> str | None:
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
