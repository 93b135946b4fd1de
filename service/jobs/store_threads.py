"""A store that blocks, called from the event loop: changes one after the other in one thread, reads in a few others."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job_store import JobStore

T = TypeVar("T")

BEGUN_WITHIN = 3.0
"""s after which a call that has not begun, because of those before it, is given up: nothing has happened then."""
READERS = 4
"""Reads at the same time. They never wait for changes."""


class StoreThreads:
    """Calls of a store, each bounded in time, and whether it can be used at present.

    Attributes:
        store: whose methods are called.
        problem: why it cannot be changed, "" if it can: as long as it stands changes are refused at once.
        troubled: set with every failure; who watches the store clears it.
    """

    def __init__(self, store: JobStore) -> None:
        self.store = store
        self.problem = "The store of the jobs is being opened."
        self.troubled = asyncio.Event()
        self._writer = ThreadPoolExecutor(1, "store-changes")
        self._readers = ThreadPoolExecutor(READERS, "store-reads")

    async def change(self, function: Callable[..., T], *arguments: Any, **named: Any) -> T:
        """Call a method that changes something.

        Raises:
            StoreUnavailable: see `JobStore`; also where it is known to be in vain, or others take too long.
        """

        def begin() -> T:
            self.refuse()  # what waited behind a call that found the problem
            return function(*arguments, **named)

        self.refuse()
        return await self._call(self._writer, begin)

    async def read(self, function: Callable[..., T], *arguments: Any) -> T:
        """Call a method that changes nothing.

        Raises:
            StoreUnavailable: it cannot be read.
        """
        return await self._call(self._readers, lambda: function(*arguments))

    async def supervise(self, function: Callable[[], T]) -> T:
        """Call a method that finds out about problems, whatever is known of them.

        Raises:
            StoreUnavailable: there is one.
        """
        return await self._call(self._writer, function)

    def refuse(self) -> None:
        """Refuse what would change something while there is a problem.

        Raises:
            StoreUnavailable: there is one.
        """
        if self.problem:
            raise StoreUnavailable(self.problem)

    async def close(self) -> None:
        """Close the store and let go of the threads."""
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(self._writer, self.store.close)
        self._writer.shutdown(wait=False)
        self._readers.shutdown(wait=False)

    async def _call(self, pool: ThreadPoolExecutor, function: Callable[[], T]) -> T:
        def noted() -> T:
            try:
                return function()
            except StoreUnavailable as error:
                self._note(error)  # in this thread, before it begins the next call
                raise

        call = pool.submit(noted)
        answer = asyncio.wrap_future(call)
        try:
            done, _ = await asyncio.wait([answer], timeout=BEGUN_WITHIN)
            if not done and call.cancel():
                busy = StoreUnavailable(f"The store of the jobs has been busy for {BEGUN_WITHIN:g} s.")
                self._note(busy)
                raise busy
            return await answer
        except StoreUnavailable:
            self.troubled.set()
            raise

    def _note(self, error: StoreUnavailable) -> None:
        if error.lasting:
            self.problem = error.detail
