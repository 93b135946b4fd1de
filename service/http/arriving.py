"""A body as it arrives; who sends nothing for a while is not waited for.

Bodies take turns, one piece at a time: between two pieces, of whatever bodies, the event loop looks at everything else.
Otherwise each look at thirty large bodies would be as long as thirty pieces, and a small request needs several looks.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from weakref import WeakKeyDictionary

from fastapi import Request

from duocell.service.common.problems import Problem

STALLED = 15.0
"""s without a byte of a body that was begun."""


_turns: WeakKeyDictionary[asyncio.AbstractEventLoop, asyncio.Lock] = WeakKeyDictionary()


async def arriving(request: Request) -> AsyncIterator[bytes]:
    """The pieces of a body.

    Raises:
        Problem: nothing came for `STALLED` s.
    """
    stream = request.stream().__aiter__()
    turn = _turns.setdefault(asyncio.get_running_loop(), asyncio.Lock())
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
        async with turn:
            await asyncio.sleep(0)  # nothing more is read from a socket before it is asked for
