"""Is the service fit to solve? It finds out by solving, again and again."""

from __future__ import annotations

import asyncio
import logging
import time
from typing import Any

from duocell.service.workers.executor import Executor, SolveFailed

log = logging.getLogger(__name__)

MAX_AGE = 30.0
"""s; an older self-test proves nothing."""
RETRY = 1.0
"""s between self-tests while they fail."""


class Monitor:
    """Runs the self-test in the background and remembers how the last one ended."""

    def __init__(self, executor: Executor, every: float) -> None:
        self._executor = executor
        self._every = every
        self._passed_at: float | None = None
        self._failure = "No self-test has finished yet; the workers are starting."
        self.first_pass = asyncio.Event()

    async def watch(self) -> None:
        """Test until cancelled."""
        while True:
            await asyncio.sleep(self._every if await self._test() else RETRY)

    async def _test(self) -> bool:
        try:
            await self._executor.self_test()
        except SolveFailed as error:
            log.warning("self-test failed: %s", error.detail)
            self._failure = error.detail
            return False
        self._passed_at = time.monotonic()
        self._failure = ""
        self.first_pass.set()
        return True

    def report(self) -> dict[str, Any]:
        """The checks of /readyz: name -> whether it holds, and numbers."""
        age = None if self._passed_at is None else time.monotonic() - self._passed_at
        workers = self._executor.alive()
        fresh = age is not None and age <= MAX_AGE and not self._failure
        return {
            "workers": {"ok": workers > 0, "alive": workers, "detail": "" if workers else "No worker lives (yet)."},
            "self_test": {"ok": fresh, "age": age, "detail": self._failure},
        }
