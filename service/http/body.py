"""Reading a JSON body, but never more of it than is allowed."""

from __future__ import annotations

from fastapi import Request

from duocell.service.common.issues import Issue
from duocell.service.common.problems import Problem
from duocell.service.http.arriving import arriving


async def json_body(request: Request, most: int) -> bytes:
    """The body of a request.

    Args:
        request: whose body has not been read yet.
        most: bytes that it may have.

    Raises:
        Problem: it calls itself something other than JSON, is too long, or does not arrive.
    """
    media_type = request.headers.get("content-type", "application/json").split(";")[0].strip().lower()
    if media_type != "application/json" and not media_type.endswith("+json"):
        raise Problem(
            "unsupported-media-type",
            f"The body calls itself {media_type[:80]!r}. Send JSON with the header 'Content-Type: application/json'.",
        )
    body = bytearray()
    async for chunk in arriving(request):
        body += chunk
        if len(body) > most:
            detail = f"The body has more than {most} bytes (DUOCELL_MAX_BODY). Send fewer poses."
            raise Problem("body-too-large", detail, errors=[Issue("", detail)], headers={"Connection": "close"})
    return bytes(body)
