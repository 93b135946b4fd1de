"""``duocell serve`` with a probe in its event loop: ``GET /probe`` tells how long the loop was held, and forgets it.

    python -m bench.timings.probed HOST PORT

A task of the loop wakes up every millisecond. Between two of its turns the loop was held for as long as its thread has
worked, whatever else the machine does (``cpu``, s), and the task was late by as much as everybody else (``late``, s).
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI

from duocell.service import app as service
from duocell.service.cli.serve import serve

EVERY = 0.001
"""s"""

make_app = service.create_app


class Probe:
    """The longest that the loop was held."""

    def __init__(self) -> None:
        self.cpu = self.late = 0.0

    async def watch(self) -> None:
        """Look until cancelled."""
        while True:
            wall, cpu = time.perf_counter(), time.thread_time()
            await asyncio.sleep(EVERY)
            self.late = max(self.late, time.perf_counter() - wall - EVERY)
            self.cpu = max(self.cpu, time.thread_time() - cpu)

    async def tell(self) -> dict[str, float]:
        """What was seen since it was last asked."""
        seen = {"cpu": self.cpu, "late": self.late}
        self.cpu = self.late = 0.0
        return seen


def probed_app(*arguments: Any, **named: Any) -> FastAPI:
    """The service with a probe in it."""
    app, probe = make_app(*arguments, **named), Probe()
    inner = app.router.lifespan_context

    @asynccontextmanager
    async def lifespan(some: FastAPI) -> AsyncIterator[Any]:
        async with inner(some) as state:
            watching = asyncio.create_task(probe.watch())
            try:
                yield state
            finally:
                watching.cancel()

    app.router.lifespan_context = lifespan
    app.add_api_route("/probe", probe.tell)
    return app


if __name__ == "__main__":
    service.create_app = probed_app
    sys.exit(serve(host=sys.argv[1], port=int(sys.argv[2])))
