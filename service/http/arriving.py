"""A body as it arrives; who sends nothing for a while is not waited for."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

from fastapi import Request

from service.problems import Problem

STALLED = 15.0
"""s without a byte of a body that was begun."""


async def arriving(request: Request) -> AsyncIterator[bytes]:
    """The pieces of a body.

    Raises:
        Problem: nothing came for `STALLED` s.
    """
    stream = request.stream().__aiter__()
    while True:
        try:
            async with asyncio.timeout(STALLED):
                piece = await anext(stream)
        except StopAsyncIteration:
            return
        except TimeoutError as error:
            detail = f"Nothing of the body came for {STALLED:g} s. Send it again, without a pause."
            raise Problem("too-slow", detail, headers={"Connection": "close"}) from error
        yield piece
