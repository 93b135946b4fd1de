"""Tables of every age become those of this version."""

import json
import shutil
import sqlite3
from pathlib import Path

import pytest
from alembic import command
from alembic.script import ScriptDirectory

from duocell.service.common.database_url import FILE, sqlite_url
from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job import JobStatus
from duocell.service.jobs.job_store import JobFilter
from duocell.service.store.engine import make_engine
from duocell.service.store.migrate import HEAD, configuration, revision, upgrade
from duocell.service.store.sql import SqlJobStore
from tests.support import postgres

OLD = Path(__file__).parents[2] / "data" / "store" / "revision_0001.sqlite3"
"""Written by the first version of the store: a job that succeeded, one that failed, one running, one queued."""


def test_the_head_is_named_where_it_is_looked_for() -> None:
    assert ScriptDirectory.from_config(configuration()).get_heads() == [HEAD]


def test_migrations_lead_to_the_tables_of_the_models(url: str) -> None:
    engine = make_engine(url)
    upgrade(engine)
    with engine.connect() as connection:
        command.check(configuration(connection))  # raises on any difference
    engine.dispose()


def test_an_empty_database_gets_tables_and_an_old_one_is_left_alone(tmp_path: Path) -> None:
    engine = make_engine(sqlite_url(tmp_path))
    assert revision(engine) is None
    assert upgrade(engine) == (None, HEAD)
    assert upgrade(engine) == (HEAD, HEAD)
    engine.dispose()


def test_an_old_file_is_migrated_with_everything_in_it(tmp_path: Path) -> None:
    shutil.copy(OLD, tmp_path / FILE)
    store = SqlJobStore(sqlite_url(tmp_path))
    store.open()
    store.check()
    jobs = store.page(10, None, JobFilter())
    assert [job.status.value for job in jobs] == ["queued", "running", "failed", "succeeded"]
    succeeded = store.get(jobs[3].id)
    assert succeeded is not None
    assert succeeded.result is not None
    assert json.loads(succeeded.result)["objective"] == succeeded.objective
    assert json.loads(succeeded.request)["name"] == "kept from revision 0001"
    assert [event.kind for event in store.events(jobs[3].id, 0, 10)] == ["queued", "running", "done"]
    keyed = store.with_key("", "old key")
    assert keyed is not None
    assert keyed.job.id == jobs[3].id
    claimed = store.claim(jobs[0].id, [])
    assert claimed is not None
    assert claimed.status is JobStatus.RUNNING
    store.close()


def test_a_newer_file_is_refused(tmp_path: Path) -> None:
    engine = make_engine(sqlite_url(tmp_path))
    upgrade(engine)
    with engine.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    engine.dispose()
    store = SqlJobStore(sqlite_url(tmp_path))
    with pytest.raises(StoreUnavailable, match="newer than this version knows"):
        store.open()
    store.close()


def test_a_migration_that_fails_changes_nothing(tmp_path: Path) -> None:
    shutil.copy(OLD, tmp_path / FILE)
    before = schema(tmp_path / FILE)
    with sqlite3.connect(tmp_path / FILE) as connection:
        connection.execute("CREATE TABLE pulse (something TEXT)")  # in the way of the next migration
    connection.close()
    store = SqlJobStore(sqlite_url(tmp_path))
    with pytest.raises(StoreUnavailable):
        store.open()
    store.close()
    with sqlite3.connect(tmp_path / FILE) as connection:
        connection.execute("DROP TABLE pulse")
        assert connection.execute("SELECT version_num FROM alembic_version").fetchone() == ("0001",)
    connection.close()
    assert schema(tmp_path / FILE) == before


def schema(file: Path) -> list[str]:
    connection = sqlite3.connect(file)
    found = [row[0] for row in connection.execute("SELECT sql FROM sqlite_master ORDER BY name") if row[0]]
    connection.close()
    return found


def test_postgresql_is_migrated_by_hand() -> None:
    with postgres.serving() as url:
        store = SqlJobStore(url)
        with pytest.raises(StoreUnavailable, match=r"no tables yet.*duocell migrate"):
            store.open()
        engine = make_engine(url)
        upgrade(engine)
        engine.dispose()
        store.open()
        store.close()
