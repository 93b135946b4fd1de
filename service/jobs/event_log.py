"""The events of a job under way: kept here from its taking-up to its end, whatever is stored of them meanwhile."""

from __future__ import annotations

import asyncio
import json
from datetime import UTC, datetime
from typing import Any

from duocell.service.common.timestamps import timestamp
from duocell.service.jobs.job import JobEvent

LAST = "done"
"""Kind of the event after which none comes."""
STRIDE = 100_000
"""Events of a job are numbered from its revision times this: numbers rise also across a restart that lost a few."""


class EventLog:
    """Numbers events, hands them to those who follow, and remembers up to where they are stored."""

    def __init__(self) -> None:
        self._events: list[JobEvent] = []
        self._number = 0
        self._saved = 0
        self._news: asyncio.Future[None] | None = None
        self.closed = False

    def state(self, revision: int, kind: str, **data: Any) -> JobEvent:
        """An event that belongs to a change of state; to be told once that change is stored."""
        self._number = max(self._number, revision * STRIDE)
        return self._next(kind, json.dumps(data, ensure_ascii=False))

    def note(self, kind: str, data: str) -> None:
        """Tell of something that happened; ``data`` is a JSON object."""
        self.tell(self._next(kind, data))

    def tell(self, *events: JobEvent) -> None:
        """Hand events to those who follow."""
        self._events += events
        self._wake()

    def unsaved(self) -> list[JobEvent]:
        """Events that are not known to be stored."""
        return self.after(self._saved)

    def saved(self, number: int) -> None:
        """Everything up to this number is stored."""
        self._saved = max(self._saved, number)

    def close(self) -> None:
        """Nothing more will come."""
        self.closed = True
        self._wake()

    def after(self, number: int) -> list[JobEvent]:
        """Events with higher numbers, so far."""
        start = len(self._events)
        while start and self._events[start - 1].number > number:
            start -= 1
        return self._events[start:]

    async def news(self, timeout: float) -> bool:
        """Wait for something new for at most ``timeout`` s; False if nothing came."""
        if self._news is None:
            self._news = asyncio.get_running_loop().create_future()
        done, _ = await asyncio.wait([self._news], timeout=timeout)
        return bool(done)

    def _wake(self) -> None:
        news, self._news = self._news, None
        if news is not None:
            news.set_result(None)

    def _next(self, kind: str, data: str) -> JobEvent:
        self._number += 1
        at = f'"at": "{timestamp(datetime.now(UTC))}"'
        return JobEvent(self._number, kind, f"{{{at}}}" if data == "{}" else f"{{{at}, {data[1:]}")
