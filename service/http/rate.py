"""Rate limits: a token bucket per client."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, floor

MOST_CLIENTS = 10_000
"""Buckets that are remembered; those not used for longest are forgotten, which fills them."""


@dataclass(frozen=True, slots=True)
class Allowance:
    """What a bucket says to a request.

    Attributes:
        granted: whether it may go on.
        remaining: requests that may follow at once.
        refill: s until the bucket is full again, rounded up.
        retry_after: s until one more is granted, rounded up; 0 if this one was.
    """

    granted: bool
    remaining: int
    refill: int
    retry_after: int


class Buckets:
    """A bucket of ``burst`` requests per client that fills at ``rate`` requests per second.

    Not safe for threads: the event loop is the only one to ask.
    """

    def __init__(self, rate: float, burst: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._burst = burst
        self._clock = clock
        self._levels: OrderedDict[str, tuple[float, float]] = OrderedDict()  # requests left, when that was [s]

    @property
    def policy(self) -> str:
        """The limit in the words of the RateLimit-Policy header: so many requests in so many seconds."""
        return f'"default";q={self._burst};w={max(1, ceil(self._burst / self._rate))}'

    def take(self, client: str) -> Allowance:
        """Take one request out of a client's bucket, if there is one."""
        now = self._clock()
        level, then = self._levels.get(client, (float(self._burst), now))
        level = min(float(self._burst), level + (now - then) * self._rate)
        granted = level >= 1.0
        level -= 1.0 if granted else 0.0
        self._levels[client] = level, now
        self._levels.move_to_end(client)
        if len(self._levels) > MOST_CLIENTS:
            self._levels.popitem(last=False)
        return Allowance(
            granted=granted,
            remaining=floor(level),
            refill=ceil((self._burst - level) / self._rate),
            retry_after=0 if granted else max(1, ceil((1.0 - level) / self._rate)),
        )
