"""Following a solve from outside, and stopping it, without an argument in every signature on the way.

    with watching(report, stop):
        optimize(cell)

Inside the block everything that runs in this thread tells ``report`` what it does, and asks ``stop`` whether to go on;
nothing is told and nobody is asked elsewhere. What asks whether to go on also ends where its time is over (`ending`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from math import inf

from duocell.optimizer.monitoring.events import Event


class Cancelled(Exception):
    """The solve was told to stop, and has stopped: no error, but no answer either."""


class OutOfTime(Cancelled):
    """The time of a block of `ending` was over, and it has stopped."""


@dataclass(frozen=True, slots=True)
class _Watch:
    report: Callable[[Event], None]
    stop: Callable[[], bool]


_watch: ContextVar[_Watch | None] = ContextVar("watch", default=None)
_end: ContextVar[float] = ContextVar("end", default=inf)


@contextmanager
def watching(report: Callable[[Event], None], stop: Callable[[], bool]) -> Iterator[None]:
    """Follow what runs in the block.

    Args:
        report: told every event; it should return soon.
        stop: asked many times a second, also from inside IPOPT; once True, the block ends with `Cancelled`.

    Raises:
        Cancelled: ``stop`` said so.
    """
    token = _watch.set(_Watch(report, stop))
    try:
        yield
    finally:
        _watch.reset(token)


@contextmanager
def overhearing(report: Callable[[Event], None]) -> Iterator[None]:
    """Tell somebody else, too, what is told in the block."""
    watch = _watch.get()
    if watch is None:
        with watching(report, lambda: False):
            yield
        return

    def both(event: Event) -> None:
        watch.report(event)
        report(event)

    token = _watch.set(replace(watch, report=both))
    try:
        yield
    finally:
        _watch.reset(token)


@contextmanager
def unheard() -> Iterator[None]:
    """Tell nothing of what runs in the block; it can be stopped all the same."""
    watch = _watch.get()
    token = _watch.set(None if watch is None else replace(watch, report=lambda event: None))
    try:
        yield
    finally:
        _watch.reset(token)


@contextmanager
def ending(deadline: float) -> Iterator[None]:
    """Let the block end once a time is over: wherever it asks whether to go on, also from inside IPOPT.

    Searches and proofs look at their own limits and keep what they have; this ends those that do not.

    Args:
        deadline: `time.perf_counter` value; an earlier one of a block around counts as well.

    Raises:
        OutOfTime: the time was over.
    """
    token = _end.set(min(deadline, _end.get()))
    try:
        yield
    finally:
        _end.reset(token)


def watched() -> bool:
    """Whether anybody wants to know: events that cost something to make need not be made otherwise."""
    return _watch.get() is not None


def tell(event: Event) -> None:
    """Report an event to whoever watches."""
    watch = _watch.get()
    if watch is not None:
        watch.report(event)


def stopped() -> bool:
    """Whether whoever watches wants an end, or the time of a block is over."""
    watch = _watch.get()
    return (watch is not None and watch.stop()) or time.perf_counter() > _end.get()


def check_stop() -> None:
    """Go on, or not; loops call it once per round.

    Raises:
        Cancelled: whoever watches wants an end.
        OutOfTime: the time of a block of `ending` is over.
    """
    watch = _watch.get()
    if watch is not None and watch.stop():
        raise Cancelled
    if time.perf_counter() > _end.get():
        raise OutOfTime
