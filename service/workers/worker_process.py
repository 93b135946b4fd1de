"""The server's side of one worker process."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
from collections.abc import Callable
from itertools import count
from multiprocessing.context import ForkServerProcess
from typing import Any, Self, TypeVar

from duocell.service.workers import fork_server, worker
from duocell.service.workers.answer import Answer
from duocell.service.workers.executor import Report, WorkerDied
from duocell.service.workers.fork_server import exit_code, start_process
from duocell.service.workers.messages import frame, next_message
from duocell.service.workers.worker import Done, Run, Stop, Told

log = logging.getLogger(__name__)

Made = TypeVar("Made")

UNKNOWN = 255
"""Exit code of a process whose end nobody could tell of; so does `multiprocessing`."""
TOLD_WITHIN = 5.0
"""s for the exit code of a process that has closed its end of the socket."""

_numbers = count(1)


class WorkerProcess:
    """One process, and what it is doing.

    Attributes:
        pid: of the process.
        ended: done when the process is gone; its exit code, negative for a signal.
    """

    def __init__(self, process: ForkServerProcess, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._process = process
        self.pid = process.pid
        self._writer = writer
        self._number = 0
        self._reply: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._report: Report | None = None
        self.ended: asyncio.Task[int] = asyncio.create_task(self._attend(reader))

    @classmethod
    async def start(cls, *, tested: bool = True) -> Self:
        """Start a process; it is not warm yet.

        Args:
            tested: whether it begins with a self-test; what solves should.

        Raises:
            TimeoutError, OSError, EOFError: see `start_process`.
        """
        process, ours = await start_process(worker.main, (tested,), "duocell-worker")
        return cls(process, *await asyncio.open_unix_connection(sock=ours))

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        return not self.ended.done()

    async def warm(self) -> Answer:
        """The answer of the self-test that a worker begins with, an empty one without it.

        Raises:
            WorkerDied: it did not survive it.
        """
        answer: Answer = await asyncio.shield(self._reply)
        return answer

    def begin(self, function: Callable[..., Made], arguments: tuple[Any, ...], report: Report) -> asyncio.Future[Made]:
        """Have a function called; what it returns, or `WorkerDied`, will be in the future."""
        self._number, self._report = next(_numbers), report
        self._reply = asyncio.get_running_loop().create_future()
        if self.alive:
            self._writer.write(frame(Run(self._number, function, arguments)))
        else:
            self._reply.set_exception(WorkerDied("The worker process was gone already."))
        return self._reply

    def ask_to_stop(self) -> None:
        """Tell the run under way to end; the worker looks at it many times a second."""
        if self.alive:
            self._writer.write(frame(Stop(self._number)))

    def kill(self) -> None:
        """End the process, whatever it is doing; what it was doing ends in `WorkerDied`.

        Not by `multiprocessing`, which takes it for dead once the process it was forked from is gone.
        """
        if self.alive and self.pid is not None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    async def _attend(self, reader: asyncio.StreamReader) -> int:
        """Take messages until the process is gone."""
        try:
            while True:
                message = await next_message(reader)
                if isinstance(message, Told):
                    if message.number == self._number and self._report is not None:
                        self._report(message.kind, message.data)
                elif isinstance(message, Done) and not self._reply.done():
                    self._report = None
                    self._reply.set_result(message.answer)
        except (EOFError, ConnectionError):
            pass  # it is gone, or about to go
        finally:
            self._writer.close()
        code = await self._exit_code()
        if not self._reply.done():
            self._reply.set_exception(WorkerDied(_obituary(code)))
            self._reply.exception()  # nobody need be waiting for it
        return code

    async def _exit_code(self) -> int:
        """How the process ended, once it is known to have."""
        code = await exit_code(self._process, TOLD_WITHIN)
        if code is None:  # it hangs, or the fork server, which has to tell of its end, does
            if self.pid is not None:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(self.pid, signal.SIGKILL)
            await fork_server.kill()
            code = await exit_code(self._process, TOLD_WITHIN)
        if code is None:
            return UNKNOWN
        with contextlib.suppress(ValueError):
            self._process.close()  # two pipes, which would stay open until some later collection of garbage
        return code


def _obituary(code: int) -> str:
    """How a process ended, in words."""
    end = f"exit code {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"
    return f"The worker process was ended by {end} in the middle of the solve."
