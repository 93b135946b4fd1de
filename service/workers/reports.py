"""From the events of a solve to those that are sent on: as many as a person can follow, however long it takes."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict
from math import isfinite
from typing import Any

from duocell.optimizer.monitoring.events import Bounded, Event, Incumbent, Iterated
from duocell.optimizer.progress.known import Known
from duocell.service.results.documents import incumbent_document
from duocell.service.workers.best_known import KnownAnswer

FREQUENT = (Bounded, Iterated)
"""Events of which not every one matters: the next one says more."""
LEAST, SHARE = 0.1, 0.01
"""s, and share of the time since the start: frequent events are at least this far apart, so their number grows only
with the logarithm of the time."""

Send = Callable[[str, str], None]
"""Takes a kind and the JSON text of the data."""


class Reports:
    """Passes events on; of the frequent ones the first, some on the way, and the last before something else."""

    def __init__(self, send: Send, clock: Callable[[], float] = time.monotonic) -> None:
        self._send = send
        self._clock = clock
        self._began = clock()
        self._next = 0.0
        self._held: Event | None = None

    def __call__(self, event: Event) -> None:
        """Tell of an event."""
        if isinstance(event, Known):
            return
        if isinstance(event, KnownAnswer):
            self._send(event.kind, event.text)
            return
        if isinstance(event, FREQUENT):
            if self._held is not None and type(self._held) is not type(event):
                self._release()
            now = self._clock()
            if now < self._next:
                self._held = event
                return
            self._next = now + max(LEAST, SHARE * (now - self._began))
            self._held = None
        else:
            self._release()
        self._send(event.kind, text_of(event))

    def _release(self) -> None:
        held, self._held = self._held, None
        if held is not None:
            self._send(held.kind, text_of(held))


def text_of(event: Event) -> str:
    """JSON of an event's data; what JSON cannot hold becomes null."""
    if isinstance(event, Incumbent):
        return json.dumps(incumbent_document(event), ensure_ascii=False)
    return json.dumps({name: _plain(value) for name, value in asdict(event).items()}, ensure_ascii=False)


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not isfinite(value) else value
