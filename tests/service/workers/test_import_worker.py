"""Uploads are read whatever has happened to processes before: killed, stopped, broken down."""

import asyncio
import operator
import os
import signal
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

import pytest

from duocell.service.common.issues import InvalidRequest
from duocell.service.workers import fork_server
from duocell.service.workers.import_worker import ImportWorker
from tests.support.server import alive, children


def asked(trial: Callable[[ImportWorker], Coroutine[Any, Any, None]], limit: float = 60.0) -> None:
    async def inside() -> None:
        worker = ImportWorker(limit)
        try:
            await trial(worker)
        finally:
            await worker.stop()

    asyncio.run(inside())


def test_an_upload_is_read_after_every_idle_process_was_killed() -> None:
    async def trial(worker: ImportWorker) -> None:
        assert await worker.run(operator.add, 1, 2) == 3
        for forker in forkers():
            for pid in children(forker):
                with suppress(ProcessLookupError):  # it was ended by the worker meanwhile
                    os.kill(pid, signal.SIGKILL)
        assert await worker.run(operator.add, 3, 4) == 7

    asked(trial)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_an_upload_is_read_after_the_fork_server_was_killed_or_stopped(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The event loop goes on meanwhile."""
    monkeypatch.setattr(fork_server, "NEXT_WITHIN", 1.0)

    async def trial(worker: ImportWorker) -> None:
        assert await worker.run(operator.add, 1, 2) == 3
        before = forkers()
        assert before
        for pid in before:
            os.kill(pid, number)
        reading = asyncio.create_task(worker.run(operator.add, 3, 4))
        ticks = 0
        while not reading.done():
            await asyncio.sleep(0.01)
            ticks += 1
        assert await reading == 7
        assert ticks > 3
        assert not any(alive(pid) for pid in before)

    asked(trial)


def test_an_upload_is_read_after_the_fork_server_has_lost_its_socket() -> None:
    """As one has that is dying, for a while: it counts as alive and does not answer."""

    async def trial(worker: ImportWorker) -> None:
        assert await worker.run(operator.add, 1, 2) == 3
        before = forkers()
        Path(forkserver._forkserver._forkserver_address).unlink()  # type: ignore[attr-defined]
        assert await worker.run(operator.add, 3, 4) == 7
        assert not any(alive(pid) for pid in before)

    asked(trial)


def test_what_takes_too_long_is_ended_and_the_next_is_read() -> None:
    async def trial(worker: ImportWorker) -> None:
        with pytest.raises(InvalidRequest) as caught:
            await worker.run(time.sleep, 600.0)
        assert caught.value.issues[0].code == "too-large"
        assert await worker.run(operator.add, 1, 2) == 3

    asked(trial, 3.0)


def test_what_breaks_its_process_down_is_to_blame_and_the_next_is_read() -> None:
    async def trial(worker: ImportWorker) -> None:
        with pytest.raises(InvalidRequest, match="broke down"):
            await worker.run(os._exit, 3)
        assert await worker.run(operator.add, 1, 2) == 3

    asked(trial)


def forkers() -> set[int]:
    """Processes of this one that others are forked from."""
    pid = fork_server._pid()
    return {pid} & children(os.getpid())
