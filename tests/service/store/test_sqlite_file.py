"""Files that are deleted, replaced, damaged, or locked by another program, while the store has them open."""

import shutil
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from duocell.service.common.database_url import FILE, sqlite_url
from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job_store import JobFilter
from duocell.service.store import engine
from duocell.service.store.sql import SqlJobStore
from tests.service.store.test_job_store import DONE, added, job, running


@pytest.fixture
def kept(tmp_path: Path) -> Iterator[SqlJobStore]:
    store = SqlJobStore(sqlite_url(tmp_path))
    store.open()
    yield store
    store.close()


@pytest.mark.parametrize("suffix", ["", "-wal", "-shm"])
def test_nothing_is_acknowledged_that_would_be_gone(kept: SqlJobStore, tmp_path: Path, suffix: str) -> None:
    added(kept, job())
    file = tmp_path / (FILE + suffix)
    aside = tmp_path / "aside"
    file.rename(aside)
    for _ in range(2):
        with pytest.raises(StoreUnavailable, match="deleted or replaced"):
            kept.add(job(1), [])
        with pytest.raises(StoreUnavailable, match="deleted or replaced"):
            kept.check()
    shutil.copy(aside, file)
    with pytest.raises(StoreUnavailable, match="deleted or replaced"):
        kept.check()
    aside.rename(file)  # the same file again
    kept.check()
    kept.add(job(2), [])
    assert [one.name for one in kept.page(10, None, JobFilter())] == ["job 2", "job 0"]


def test_a_change_during_which_the_files_go_is_not_acknowledged(
    kept: SqlJobStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fence = kept._lease.fence

    def gone(connection: object) -> int:
        (tmp_path / FILE).unlink()
        return fence(connection)  # type: ignore[arg-type]

    monkeypatch.setattr(kept._lease, "fence", gone)
    with pytest.raises(StoreUnavailable, match="deleted or replaced"):
        kept.add(job(), [])


def damage(file: Path, table: str) -> None:
    """Overwrite the root page of a table or index."""
    with sqlite3.connect(file) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        size = connection.execute("PRAGMA page_size").fetchone()[0]
        root = connection.execute("SELECT rootpage FROM sqlite_master WHERE name = ?", (table,)).fetchone()[0]
    connection.close()
    with file.open("r+b") as stream:
        stream.seek((root - 1) * size)
        stream.write(b"\xa5" * size)


def test_damage_that_a_change_meets_is_not_forgotten_by_the_next_check(kept: SqlJobStore, tmp_path: Path) -> None:
    for number in range(3):
        kept.finish(running(kept, number), DONE, [])
    damage(tmp_path / FILE, "sqlite_autoindex_jobs_1")
    kept.check()  # it has met nothing yet
    with pytest.raises(StoreUnavailable):
        kept.add(job(9), [])
    for _ in range(2):
        with pytest.raises(StoreUnavailable, match="damaged"):
            kept.check()


def test_a_damaged_file_is_not_opened(tmp_path: Path) -> None:
    store = SqlJobStore(sqlite_url(tmp_path))
    store.open()
    added(store, *(job(number) for number in range(3)))
    store.close()
    damage(tmp_path / FILE, "jobs_sequence")
    again = SqlJobStore(sqlite_url(tmp_path))
    with pytest.raises(StoreUnavailable, match=r"damaged|malformed"):
        again.open()
    again.close()


def test_another_program_that_writes_is_waited_for_shortly_and_reads_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "BUSY_TIMEOUT", 50)
    store = SqlJobStore(sqlite_url(tmp_path))
    store.open()
    (new,) = added(store, job())
    other = sqlite3.connect(tmp_path / FILE, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    for _ in range(2):
        with pytest.raises(StoreUnavailable, match="locked"):
            store.add(job(1), [])
        with pytest.raises(StoreUnavailable, match="locked"):
            store.check()
        assert store.get(new.id) == new
    other.execute("ROLLBACK")
    other.close()
    store.check()
    store.add(job(2), [])
    store.close()
