"""What PostgreSQL has and SQLite has not: connections that break, and a service that lives on."""

from typing import Any

import pytest
from fastapi.testclient import TestClient
from pydantic import SecretStr
from sqlalchemy import text

from duocell.service.app import create_app
from duocell.service.common.database_url import checked_url
from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.settings import Settings
from duocell.service.store.engine import make_engine
from duocell.service.store.sql import SqlJobStore
from tests.service.conftest import FakeExecutor
from tests.support.postgres import emptied
from tests.support.server import has, line_request, until


def cut_all_connections(url: str) -> None:
    """What a restart of the database does to its clients."""
    engine = make_engine(url)
    with engine.connect() as connection:
        others = "pid <> pg_backend_pid() AND backend_type = 'client backend'"
        connection.execute(text(f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE {others}"))
    engine.dispose()


@pytest.fixture
def empty(postgres_url: str) -> str:
    return emptied(postgres_url)


def test_possession_that_was_lost_is_taken_again_unless_somebody_else_has_it(empty: str) -> None:
    first, second = SqlJobStore(empty), SqlJobStore(empty)
    first.open()
    cut_all_connections(empty)
    first.check()
    with pytest.raises(StoreUnavailable, match="Another server"):
        second.open()
    cut_all_connections(empty)
    second.open()
    with pytest.raises(StoreUnavailable, match="Another server"):
        first.check()
    second.close()
    first.open()
    first.check()
    first.close()


def test_a_service_on_postgresql_lives_through_a_restart_of_the_database(empty: str) -> None:
    fake = FakeExecutor()
    settings = Settings(workers=1, database_url=SecretStr(empty), drain=0.0)
    with TestClient(create_app(settings, fake), raise_server_exceptions=False) as client:
        wait = {"Prefer": "wait=10"}
        first = client.post("/v1/layouts", json=line_request(3, "first"), headers=wait)
        assert first.json()["status"] == "succeeded"
        fake.seconds = 1.0
        running = client.post("/v1/layouts", json=line_request(3, "second")).headers["location"]
        cut_all_connections(empty)
        until(lambda: client.get(running).json()["status"] == "succeeded")
        assert client.get(running).json()["attempts"] == 1
        fake.seconds = 0.0
        until(lambda: client.post("/v1/layouts", json=line_request(3), headers=wait).status_code == 200)
        fake.seconds = 60.0
        waiting = [client.post("/v1/layouts", json=line_request(3)).headers["location"] for _ in range(2)]
    fake = FakeExecutor()
    with TestClient(create_app(settings, fake)) as client:
        for location in waiting:
            until(has(client, location, "status", "succeeded"))
        assert client.get(first.headers["location"]).json() == first.json()


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ("postgresql://u:p@h:5432/d", "postgresql+psycopg://u:p@h:5432/d"),
        ("postgres://u:p@h/d?sslmode=require", "postgresql+psycopg://u:p@h/d?sslmode=require"),
        ("sqlite:////var/lib/jobs.sqlite3", "sqlite:////var/lib/jobs.sqlite3"),
    ],
)
def test_urls_of_databases_that_are_known(given: str, wanted: str) -> None:
    assert checked_url(given) == wanted


@pytest.mark.parametrize(
    "given", ["mysql://u:secret@h/d", "secret", "http://secret@h", "postgresql+asyncpg://u:secret@h/d"]
)
def test_urls_of_databases_that_are_not(given: str) -> None:
    with pytest.raises(ValueError, match=r"known|no URL") as caught:
        checked_url(given)
    assert "secret" not in str(caught.value)


def test_a_url_is_not_shown_with_its_password() -> None:
    settings: Any = Settings(database_url=SecretStr("postgresql://somebody:secret@h/d"))
    assert "secret" not in repr(settings)
    assert "secret" in settings.store_url()
