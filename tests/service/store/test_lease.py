"""Who owns a store, and that nobody else changes it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from bench.chaos.on_postgres import terminate_locks
from duocell.service.common.database_url import FILE, sqlite_url
from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job import Ending, JobStatus
from duocell.service.jobs.job_store import JobFilter, LeaseLost
from duocell.service.store.engine import make_engine
from duocell.service.store.lease import EXPIRES, StoreLease
from duocell.service.store.sql import SqlJobStore
from tests.service.store.test_job_store import DONE, added, event, job, running

CHANGES: dict[str, Callable[[SqlJobStore, Any, Any], object]] = {
    "add": lambda store, waiting, held: store.add(job(), []),
    "claim": lambda store, waiting, held: store.claim(waiting.id, []),
    "put_back": lambda store, waiting, held: store.put_back(held, [], counted=True),
    "finish": lambda store, waiting, held: store.finish(held, DONE, []),
    "cancel": lambda store, waiting, held: store.cancel(waiting.id, event(1)),
    "delete": lambda store, waiting, held: store.delete(waiting.id),
    "trim": lambda store, waiting, held: store.trim(0),
    "add_events": lambda store, waiting, held: store.add_events([(held.id, event(5))]),
    "check": lambda store, waiting, held: store.check(),
}


def give_lease_to(url: str, owner: str | None) -> None:
    """What a server does that takes the store over."""
    engine = make_engine(url)
    with engine.begin() as connection:
        connection.execute(text("UPDATE lease SET owner = :owner WHERE id = 1"), {"owner": owner})
    engine.dispose()


@pytest.mark.parametrize("change", CHANGES)
def test_who_has_lost_the_lease_changes_nothing(store: SqlJobStore, url: str, change: str) -> None:
    (waiting,) = added(store, job())
    held = running(store, 1)
    before = store.page(10, None, JobFilter())
    give_lease_to(url, "another")
    with pytest.raises(LeaseLost, match="Another server"):
        CHANGES[change](store, waiting, held)
    assert store.page(10, None, JobFilter()) == before  # and it can be read
    assert store.events(held.id, 0, 10) == []
    give_lease_to(url, store.owner)
    CHANGES[change](store, waiting, held)


def test_a_change_that_comes_from_an_owner_before_is_refused_though_the_attempt_is_the_same(
    store: SqlJobStore, url: str
) -> None:
    """Its answer was lost when it gave the job back; another server then had it, and began the same attempt."""
    held = running(store)
    assert store.put_back(held, [], counted=False) is not None
    other = SqlJobStore(url)
    give_lease_to(url, other.owner)
    theirs = other._change(held.id, [], lambda connection, _: _claimed(connection, held.id, other.owner))
    assert theirs is not None
    assert theirs.attempts == held.attempts
    give_lease_to(url, store.owner)
    assert store.put_back(held, [], counted=False) is None
    assert store.finish(held, Ending(JobStatus.FAILED), []) is None
    assert store.get(held.id) == theirs
    other._engine.dispose()


def _claimed(connection: Any, job_id: str, owner: str) -> Any:
    from duocell.service.store import changes

    return changes.claim(connection, job_id, owner)


def test_a_lease_is_given_back_in_the_end(store: SqlJobStore, open_store: Callable[[], SqlJobStore]) -> None:
    store.close()
    second = open_store()
    with pytest.raises(LeaseLost):
        store.add(job(), [])
    second.add(job(), [])


class HeldLock:
    """A lock whose holder lives."""

    number = 7

    def hold(self) -> None: ...

    def verify(self) -> None: ...

    def is_free(self, connection: Any, number: int) -> bool:
        return False

    def release(self) -> None: ...


def test_a_lease_without_a_beat_is_taken_after_a_time_of_our_own_clock(store: SqlJobStore, url: str) -> None:
    now = 100.0
    taker = StoreLease("taker", HeldLock(), clock=lambda: now)
    engine = make_engine(url)

    def take() -> bool:
        try:
            with engine.begin() as connection:
                taker.take(connection)
        except LeaseLost:
            return False
        return True

    assert not take()
    now += EXPIRES + 1.0
    store.check()  # it lives
    assert not take()
    now += EXPIRES - 1.0
    assert not take()
    now += 2.0
    assert take()
    with pytest.raises(LeaseLost):
        store.check()
    engine.dispose()


def test_the_session_of_the_lock_ends_and_the_lease_goes_to_who_waits(postgres_url: str) -> None:
    first, second = SqlJobStore(postgres_url), SqlJobStore(postgres_url)
    give_lease_to(postgres_url, None)
    first.open()
    with pytest.raises(LeaseLost):
        second.open()
    terminate_locks(postgres_url)
    first.check()  # nobody was faster: it has its session again
    with pytest.raises(LeaseLost):
        second.open()
    terminate_locks(postgres_url)
    second.open()
    with pytest.raises(LeaseLost):
        first.add(job(), [])
    second.add(job(), [])
    second.close()
    first.open()
    first.close()


def test_a_lock_file_that_was_deleted_is_made_again_before_another_server_comes(tmp_path: Path) -> None:
    first, second = SqlJobStore(sqlite_url(tmp_path)), SqlJobStore(sqlite_url(tmp_path))
    first.open()
    (tmp_path / f"{FILE}.lock").unlink()
    with pytest.raises(StoreUnavailable, match="deleted"):
        first.add(job(), [])
    first.check()
    first.add(job(), [])
    with pytest.raises(LeaseLost):
        second.open()
    (tmp_path / f"{FILE}.lock").unlink()
    second.open()  # it was faster
    with pytest.raises(StoreUnavailable):
        first.add(job(), [])
    with pytest.raises(LeaseLost):
        first.check()
    second.add(job(), [])
    first.close()
    second.check()
    second.close()
