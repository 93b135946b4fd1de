"""Calls of a blocking store: bounded, one change at a time, refused while they are in vain."""

import asyncio
import threading
from typing import Any

import pytest

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs import store_threads
from duocell.service.jobs.store_threads import StoreThreads


class Blocking:
    """A store whose calls wait until they are told to go on."""

    def __init__(self) -> None:
        self.go, self.begun = threading.Event(), threading.Event()
        self.calls: list[str] = []

    def wait(self, name: str) -> str:
        self.calls.append(name)
        self.begun.set()
        self.go.wait(30.0)
        return name

    def quick(self, name: str) -> str:
        self.calls.append(name)
        return name

    def fail(self, *, lasting: bool = True) -> None:
        raise StoreUnavailable("it is gone", lasting=lasting)

    def close(self) -> None: ...


def test_what_waits_too_long_for_its_turn_never_happens_and_reads_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    async def trial() -> None:
        monkeypatch.setattr(store_threads, "BEGUN_WITHIN", 0.05)
        store: Any = Blocking()
        threads = StoreThreads(store)
        threads.problem = ""
        first = asyncio.create_task(threads.change(store.wait, "first"))
        await asyncio.to_thread(store.begun.wait, 30.0)
        with pytest.raises(StoreUnavailable, match="busy"):
            await threads.change(store.quick, "second")
        assert await threads.read(store.quick, "read") == "read"
        store.go.set()
        assert await first == "first"  # begun, and so seen through however long it takes
        assert store.calls == ["first", "read"]
        await threads.close()

    asyncio.run(trial())


def test_changes_are_refused_while_there_is_a_problem_and_what_queued_before_as_well() -> None:
    async def trial() -> None:
        store: Any = Blocking()
        threads = StoreThreads(store)
        with pytest.raises(StoreUnavailable, match="opened"):
            await threads.change(store.quick, "too early")
        threads.problem = ""
        first = asyncio.create_task(threads.supervise(lambda: store.wait("first") and store.fail()))
        await asyncio.to_thread(store.begun.wait, 30.0)
        behind = asyncio.create_task(threads.change(store.quick, "behind"))
        await asyncio.sleep(0)
        store.go.set()
        for task in (first, behind):
            with pytest.raises(StoreUnavailable, match="gone"):
                await task
        assert threads.problem == "it is gone"
        assert threads.troubled.is_set()
        assert await threads.read(store.quick, "read") == "read"
        assert store.calls == ["first", "read"]
        await threads.close()

    asyncio.run(trial())


def test_a_connection_that_broke_is_no_lasting_problem() -> None:
    async def trial() -> None:
        store: Any = Blocking()
        threads = StoreThreads(store)
        threads.problem = ""
        with pytest.raises(StoreUnavailable):
            await threads.change(store.fail, lasting=False)
        assert threads.problem == ""
        assert threads.troubled.is_set()
        await threads.close()

    asyncio.run(trial())
