"""What a process of its own does with a body, and what it sends back: plain data, for not all exceptions travel."""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import NamedTuple

from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.common.priority import READING, give_way
from duocell.service.library.document_stores import View
from duocell.service.library.library import Library
from duocell.service.requests.accept import Accepted, accept, accept_evaluation
from duocell.service.settings import Limits
from duocell.service.validation.strict_json import NotJson


class Read(NamedTuple):
    """What became of a body.

    Attributes:
        accepted: the request, or None if it was refused.
        issues: why, and ``more``: how many other issues there are.
        not_json: why it is no JSON document; "" if it is one.
    """

    accepted: Accepted | None
    issues: tuple[Issue, ...] = ()
    more: int = 0
    not_json: str = ""

    def request(self) -> Accepted:
        """The request that was accepted.

        Raises:
            NotJson, InvalidRequest: it was not.
        """
        if self.accepted is not None:
            return self.accepted
        if self.not_json:
            raise NotJson(self.not_json)
        raise InvalidRequest(self.issues, self.more)


Reader = Callable[[bytes, Limits, View], Read]
"""Reads a body within limits; what of robots and meshes counts is what its sender sees."""


def read_layout(body: bytes, limits: Limits, view: View) -> Read:
    """A request for a layout."""
    return _read(lambda: accept(body, limits, Library(view.data_dir).seen_by(view)))


def read_evaluation(body: bytes, limits: Limits, view: View) -> Read:
    """A request to evaluate a layout."""
    return _read(lambda: accept_evaluation(body, limits, Library(view.data_dir).seen_by(view)))


def read_within(reader: Reader, seconds: float, body: bytes, limits: Limits, view: View) -> Read:
    """Read a body in a process that is ended when this takes it more than ``seconds`` of its own time.

    The kernel ends it (SIGPROF), also in the middle of a library; how busy the machine is does not matter.
    """
    give_way(READING)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return reader(body, limits, view)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def _read(work: Callable[[], Accepted]) -> Read:
    try:
        return Read(work())
    except InvalidRequest as error:
        return Read(None, error.issues, error.more)
    except NotJson as error:
        return Read(None, not_json=error.detail)
    except MemoryError:
        return Read(None, (Issue("", "There is not enough memory for it. Send less at a time.", "too-large"),))
