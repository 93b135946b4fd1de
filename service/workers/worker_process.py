"""The server's side of one worker process."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import multiprocessing
import os
import signal
import socket
from collections.abc import Callable
from itertools import count
from multiprocessing.context import ForkServerContext, ForkServerProcess
from typing import Any, Self, TypeVar

from service.workers import worker
from service.workers.executor import Report, WorkerDied
from service.workers.messages import frame, next_message
from service.workers.worker import Answer, Done, Run, Stop, Told

log = logging.getLogger(__name__)

Made = TypeVar("Made")

PRELOAD = "service.workers.preload"

_numbers = count(1)


def context() -> ForkServerContext:
    """Processes are forked from one that has no threads and has loaded the engines, never from this one."""
    found = multiprocessing.get_context("forkserver")
    found.set_forkserver_preload([PRELOAD])
    return found


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
        """
        ours, theirs = socket.socketpair()
        process = context().Process(target=worker.main, args=(theirs, tested), name="duocell-worker", daemon=True)
        try:
            await asyncio.to_thread(process.start)
        except BaseException:
            ours.close()
            raise
        finally:
            theirs.close()
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
        await asyncio.to_thread(self._process.join)
        exit_code = self._process.exitcode or 0
        self._process.close()  # two pipes, which would stay open until some later collection of garbage
        if not self._reply.done():
            self._reply.set_exception(WorkerDied(_obituary(exit_code)))
            self._reply.exception()  # nobody need be waiting for it
        return exit_code


def _obituary(exit_code: int) -> str:
    """How a process ended, in words."""
    end = f"exit code {exit_code}" if exit_code >= 0 else f"signal {signal.Signals(-exit_code).name}"
    return f"The worker process was ended by {end} in the middle of the solve."
