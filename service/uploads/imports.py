"""Uploads that are read while their sender does something else: what has become of each, for a while.

They are known to this process alone: after a restart the list of robots tells whether one was finished.
"""

from __future__ import annotations

import asyncio
import json
import logging
import uuid
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Literal

from duocell.service.common import problems
from duocell.service.common.issues import InvalidRequest
from duocell.service.common.problems import Problem
from duocell.service.http.error_handlers import as_problem
from duocell.service.workers.executor import Report

log = logging.getLogger(__name__)

REMEMBERED = 200
"""Uploads; the oldest that are finished are forgotten first."""


@dataclass(slots=True)
class Import:
    """An upload of a robot; shown by the names that its attributes have.

    Attributes:
        id: of it. owner: key that sent it, "" without keys. name: that the robot is to have.
        status: where it stands. link: whose meshes are taken apart, None before and after.
        links_done, links_total: links with meshes that are finished, and all of them; 0 before that is known.
        problem: the problem document of one that failed.
    """

    id: str
    owner: str
    name: str
    status: Literal["reading", "succeeded", "failed"] = "reading"
    link: str | None = None
    links_done: int = 0
    links_total: int = 0
    problem: dict[str, Any] | None = None

    @property
    def href(self) -> str:
        """Its address."""
        return f"/v1/imports/{self.id}"

    @property
    def robot(self) -> str | None:
        """Address of the robot, once it is there."""
        return f"/v1/robots/{self.name}" if self.status == "succeeded" else None


class Imports:
    """Uploads that are under way, and the last ones that were; lives in the event loop."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, Import] = OrderedDict()
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self, owner: str, name: str, work: Callable[[Report], Awaitable[object]]) -> Import:
        """Begin to read one.

        Args:
            owner: see `Import`. name: likewise.
            work: reads it and keeps the robot; it gets what is to be told kind and JSON data of what happens.
        """
        one = Import(uuid.uuid4().hex, owner, name)
        self._known[one.id] = one
        for old in [known for known in self._known.values() if known.status != "reading"][:-REMEMBERED]:
            del self._known[old.id]
        task = asyncio.create_task(_carried_out(one, work))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return one

    def get(self, import_id: str) -> Import | None:
        """One of them; None if it is not known (any more)."""
        return self._known.get(import_id)

    async def stop(self) -> None:
        """Give up what is under way."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


async def _carried_out(one: Import, work: Callable[[Report], Awaitable[object]]) -> None:
    def follow(kind: str, data: str) -> None:
        if kind == "link":
            told = json.loads(data)
            one.link, one.links_done, one.links_total = told["link"], told["done"], told["total"]

    try:
        await work(follow)
        one.status, one.links_done = "succeeded", one.links_total
    except (Problem, InvalidRequest) as error:
        one.status, one.problem = "failed", problems.document(as_problem(error)[0], one.href)
    except Exception:  # whoever asks is told that it has ended
        log.exception("an upload ended unexpectedly")
        internal = Problem("internal", "The upload ended unexpectedly; the log of the server has the details.")
        one.status, one.problem = "failed", problems.document(internal, one.href)
    finally:
        one.link = None
