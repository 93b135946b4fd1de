"""Starting processes: forked from one that has loaded the engines, which may die or stop like any other."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import multiprocessing
import os
import signal
import socket
import threading
from collections.abc import Callable
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext, ForkServerProcess
from typing import Any

log = logging.getLogger(__name__)

PRELOAD = "duocell.service.workers.preload"
FIRST_WITHIN = 300.0
"""s for a process where the engines have to be loaded first, on a machine that has other things to do."""
NEXT_WITHIN = 10.0
"""s for a process where they are loaded: it takes milliseconds. Then the fork server is taken for stopped."""

UNREACHABLE = (TimeoutError, ConnectionError, FileNotFoundError, EOFError)
"""What a fork server that has stopped, is dying, or has lost its socket is known by.

One that is dying has closed its socket a while before the system counts it as dead. Until then `multiprocessing` would
ask it again, so its end must be waited for.
"""

_loaded: set[int] = set()
"""Fork servers that have started a process, and so have loaded the engines."""


def context() -> ForkServerContext:
    """Processes are forked from one that has no threads and has loaded the engines, never from this one."""
    found = multiprocessing.get_context("forkserver")
    found.set_forkserver_preload([PRELOAD])
    return found


def warm_up() -> None:
    """Have the engines loaded; returns at once."""
    context()
    forkserver.ensure_running()


async def start_process(
    target: Callable[..., None], arguments: tuple[Any, ...], name: str
) -> tuple[ForkServerProcess, socket.socket]:
    """A new process that runs ``target`` on one end of a socket and some arguments, and the other end.

    Raises:
        TimeoutError, ConnectionError, FileNotFoundError, EOFError: the fork server did not answer in time, or cannot be
            reached. It has been ended, and the next call gets another one.
        OSError: it could not be started.
    """
    warm_up()
    asked = _pid()
    ours, theirs = socket.socketpair()
    process = context().Process(target=target, args=(theirs, *arguments), name=name, daemon=True)
    begun: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    # A thread of its own: one that hangs must take no place in a pool that others need.
    threading.Thread(target=_start, args=(process, begun), name=f"start {name}", daemon=True).start()
    limit = NEXT_WITHIN if asked in _loaded else FIRST_WITHIN
    try:
        async with asyncio.timeout(limit):
            await begun
    except BaseException as error:
        ours.close()
        if isinstance(error, UNREACHABLE) and asked == _pid():  # nobody has found another one meanwhile
            log.error("the process that others are forked from is ended: no answer within %g s (%r)", limit, error)
            await kill()
        raise
    finally:
        theirs.close()
    _loaded.add(_pid())
    return process, ours


def _start(process: ForkServerProcess, begun: asyncio.Future[None]) -> None:
    error: BaseException | None = None
    try:
        process.start()
    except BaseException as caught:
        error = caught

    def tell() -> None:
        if not begun.done():
            begun.set_exception(error) if error is not None else begun.set_result(None)
        elif error is None:  # nobody waits for it any more
            process.kill()

    with contextlib.suppress(RuntimeError):  # the loop has ended
        begun.get_loop().call_soon_threadsafe(tell)


async def kill() -> None:
    """End the fork server, whatever state it is in, and see that it is gone; those who wait for it get an error."""
    pid = _pid()
    _loaded.discard(pid)
    if pid:
        with contextlib.suppress(ProcessLookupError, ChildProcessError):
            os.kill(pid, signal.SIGKILL)
            # Only looked at: `multiprocessing` takes note of its end when the next process is started.
            while os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
                await asyncio.sleep(0.01)


def _pid() -> int:
    """Of the fork server, 0 if there is none: the library does not tell, and starts another one only if it is dead."""
    return getattr(forkserver._forkserver, "_forkserver_pid", None) or 0


async def exit_code(process: ForkServerProcess, within: float) -> int | None:
    """How a process ended; None if that is not known after some seconds, for the fork server has to tell.

    Without a thread: a fork server that is stopped tells nothing for as long as it likes.
    """
    loop = asyncio.get_running_loop()
    told = asyncio.Event()
    loop.add_reader(process.sentinel, told.set)
    try:
        async with asyncio.timeout(within):
            await told.wait()
    except TimeoutError:
        return None
    finally:
        loop.remove_reader(process.sentinel)
    process.join(0)
    return process.exitcode
