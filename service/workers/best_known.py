"""What is known while a solve goes on, sent to the server in time: it is the answer if the solve has to be ended."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from duocell.optimizer.monitoring.events import Event
from duocell.optimizer.progress.interim import interim_layout, unknown_layout, why_ended, with_what_is_missing
from duocell.optimizer.progress.known import Solved, Usable
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings
from duocell.service.common.issues import Issue
from duocell.service.results.documents import result_document
from duocell.service.workers.answer import KNOWN, answer_of

LEAST, SHARE = 0.5, 0.05
"""s, and share of the time, that making such answers may take: after a costly one the next one waits."""
QUICK = 0.2
"""s that the last answer may cost where the solve was told to end."""


@dataclass(frozen=True, slots=True)
class KnownAnswer(Event):
    """An answer that is complete, but perhaps not the best.

    Attributes:
        text: JSON of an `Answer`.
    """

    kind: ClassVar[str] = KNOWN
    text: str


class BestKnown:
    """Follows a solve and tells, now and then, the best answer so far.

    Args:
        tell: takes an event. request_hash: of the request. limit: s, what is said to have ended the solve.
        clock: s.
    """

    def __init__(
        self,
        tell: Callable[[Event], None],
        request_hash: str,
        limit: float,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._tell = tell
        self._hash = request_hash
        self._limit = limit
        self._clock = clock
        self._settings: Settings | None = None
        self._warnings: Callable[[Layout], list[Issue]] = lambda layout: []
        self._began = clock()
        self._untold: Usable | None = None
        self._next = 0.0
        self._cost = 0.0

    def begin(self) -> None:
        """Tell that nothing is known yet: the answer until something is."""
        self._send(unknown_layout(self._limit, why_ended(self._limit, found=False)))

    def understood(self, settings: Settings, warnings: Callable[[Layout], list[Issue]]) -> None:
        """Take into account what is asked for, and what is to be warned of beside a layout."""
        self._settings, self._warnings = settings, warnings
        self.begin()

    def __call__(self, event: Event) -> None:
        """See an event of the solve."""
        if isinstance(event, Solved):
            self._untold = None
            self._send(event.layout)
        elif isinstance(event, Usable):
            self._untold = event
            if self._clock() >= self._next:
                self.flush()

    def flush(self, most: float = float("inf")) -> None:
        """Tell the best so far, if it is not told and will probably take no longer than ``most`` s."""
        found = self._untold
        if found is None or self._cost > most:
            return
        self._untold = None
        began = self._clock()
        why = why_ended(self._limit, found=True)
        self._send(interim_layout(found.cell, found.points, found.time, self._limit, why, found.path))
        ended = self._clock()
        self._cost = ended - began
        self._next = ended + max(LEAST, self._cost / SHARE)

    def _send(self, layout: Layout) -> None:
        layout = with_what_is_missing(layout, self._settings)
        document = result_document(layout, self._hash, self._warnings(layout))
        self._tell(KnownAnswer(json.dumps(answer_of(document))))
