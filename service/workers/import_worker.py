"""Where uploads are read: in a process of its own, one after the other, ended when it takes too long.

The readers and the decomposition are C++ that was not written for hostile files; here they can take nothing with them.
The catalogue is listed there too: it takes seconds, in which the server has other things to do.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
from collections.abc import AsyncIterator, Callable
from concurrent.futures import BrokenExecutor
from contextlib import asynccontextmanager
from typing import Any, TypeVar, cast

from pebble import ProcessExpired, ProcessPool

from service.issues import InvalidRequest, Issue
from service.problems import Problem

log = logging.getLogger(__name__)

Made = TypeVar("Made")

PRELOAD = "service.workers.preload"
"""What the server process of `multiprocessing` has loaded, which all processes are forked from."""

RETRY_AFTER = "5"


class Intake:
    """Reads uploads.

    Args:
        time_limit: s that an upload may take.
        most: uploads at the same time, from the first byte to the answer; all but one of them wait.
    """

    def __init__(self, time_limit: float, most: int) -> None:
        self._time_limit = time_limit
        self._most = most
        self._present = 0
        self._pool: ProcessPool | None = None

    @asynccontextmanager
    async def place(self) -> AsyncIterator[None]:
        """A place for an upload, to be taken before its body is read.

        Raises:
            Problem: all are taken.
        """
        if self._present >= self._most:
            detail = f"{self._present} uploads are being read already (DUOCELL_MAX_UPLOADS). Try again soon."
            raise Problem("uploads-full", detail, headers={"Retry-After": RETRY_AFTER, "Connection": "close"})
        self._present += 1
        try:
            yield
        finally:
            self._present -= 1

    async def run(self, function: Callable[..., Made], *arguments: Any) -> Made:
        """What a function makes of an upload.

        Args:
            function: of a module, so that another process finds it; raises `InvalidRequest` if it is to blame.
            arguments: plain data.

        Raises:
            InvalidRequest: the function refuses it, takes too long, or breaks down over it.
        """
        pool = self._started()
        try:
            made, issues = await asyncio.wrap_future(
                pool.schedule(_answer, (function, *arguments), timeout=self._time_limit)
            )
        except TimeoutError as error:
            raise _refused(
                f"Reading it and taking its meshes apart takes longer than {self._time_limit:g} s "
                "(DUOCELL_UPLOAD_TIME_LIMIT). Send simplified collision meshes.",
                "too-large",
            ) from error
        except ProcessExpired as error:
            log.error("the process that read an upload ended with code %s", error.exitcode)
            raise _refused(
                "The process that read it broke down. Is it in order? Check it with another program.", "invalid-upload"
            ) from error
        except BrokenExecutor:
            self._pool = None
            raise
        if issues:
            raise InvalidRequest(issues)
        return cast(Made, made)

    def stop(self) -> None:
        """End the process; blocks until it is gone."""
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.stop()  # type: ignore[no-untyped-call]
            pool.join()

    def _started(self) -> ProcessPool:
        """The pool; it starts its process with the first upload, and another one when that has ended."""
        if self._pool is None:
            context = multiprocessing.get_context("forkserver")
            context.set_forkserver_preload([PRELOAD])
            self._pool = ProcessPool(max_workers=1, max_tasks=20, context=context)
        return self._pool


def _answer(function: Callable[..., Made], *arguments: Any) -> tuple[Made | None, list[Issue]]:
    """Runs in the process; exceptions with data in them do not travel well."""
    try:
        return function(*arguments), []
    except InvalidRequest as error:
        return None, list(error.issues)
    except MemoryError:
        return None, [Issue("", "There is not enough memory for it. Send simplified collision meshes.", "too-large")]


def _refused(detail: str, code: str) -> InvalidRequest:
    return InvalidRequest([Issue("", detail, code)])
