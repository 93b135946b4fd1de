"""A database that does not answer, or whose answer does not arrive: asked of a service, through a proxy."""

import gc
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from pydantic import SecretStr
from sqlalchemy import text

from bench.chaos.proxy import Proxy, proxied
from duocell.service.app import create_app
from duocell.service.common.database_url import checked_url
from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job_store import LeaseLost
from duocell.service.settings import Settings
from duocell.service.store import bounded_connection, engine
from duocell.service.store.engine import make_engine
from duocell.service.store.sql import SqlJobStore
from tests.service.conftest import FakeExecutor
from tests.service.store.test_job_store import job
from tests.support.server import line_request, until


@pytest.fixture
def between(postgres_url: str) -> Iterator[tuple[Proxy, str]]:
    made = make_engine(postgres_url)
    with made.begin() as connection:
        connection.execute(text("TRUNCATE jobs, events"))
        connection.execute(text("UPDATE lease SET owner = NULL"))
    made.dispose()
    with proxied(postgres_url) as (proxy, url):
        yield proxy, checked_url(url)
    # What was being opened while the database was silent is dropped unclosed by the driver: here, not in a later test.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


@pytest.mark.parametrize(
    ("what", "statement"), [("add", b"INSERT INTO jobs"), ("claim", b"started_at="), ("finish", b"finished_at=")]
)
def test_a_job_whose_commit_is_not_confirmed_ends_once(between: tuple[Proxy, str], what: str, statement: bytes) -> None:
    proxy, url = between
    fake = FakeExecutor()
    settings = Settings(workers=1, database_url=SecretStr(url), drain=0.0)
    with TestClient(create_app(settings, fake), raise_server_exceptions=False) as client:
        if what == "claim":  # queued first
            fake.seconds = 0.5
            client.post("/v1/layouts", json=line_request(3, "in the way"))
        proxy.lose_commit_of(statement)
        headers = {"Idempotency-Key": what}

        def sent() -> Any:
            return client.post("/v1/layouts", json=line_request(3, what), headers=headers).headers.get("location")

        location = first_of(sent)
        until(lambda: client.get(location).json()["status"] == "succeeded")
        until(lambda: proxy.lost == 1)
        until(lambda: client.get("/readyz").json().get("status") != "not-ready")
        assert len(client.get("/v1/layouts", params={"name": what}).json()["items"]) == 1
        assert client.get(location).json()["attempts"] == 1
        kinds = [line for line in client.get(f"{location}/events").text.splitlines() if line.startswith("event: done")]
        assert len(kinds) == 1


def first_of(ask: Callable[[], Any]) -> Any:
    """The first answer that is one, of a client that asks again."""
    found: list[Any] = []

    def answered() -> bool:
        found.append(ask())
        return bool(found[-1])

    until(answered)
    return found[-1]


def test_a_cancelling_that_was_not_confirmed_is_one(between: tuple[Proxy, str]) -> None:
    proxy, url = between
    fake = FakeExecutor()
    fake.seconds = 600.0
    settings = Settings(workers=1, database_url=SecretStr(url), drain=0.0)
    with TestClient(create_app(settings, fake), raise_server_exceptions=False) as client:
        location = client.post("/v1/layouts", json=line_request(3)).headers["location"]
        until(lambda: fake.running == 1)
        proxy.lose_commit_of(b"finished_at=")
        until(lambda: client.post(f"{location}/cancel").status_code == 202)
        assert proxy.lost == 1
        assert client.get(location).json()["status"] == "cancelled"
        until(lambda: fake.running == 0)


def holds(store: SqlJobStore) -> bool:
    """Whether a store has its lease again; the database may take a while to notice that the old session is gone."""
    try:
        store.check()
    except LeaseLost:
        return False
    return True


def test_a_silent_database_is_given_up(between: tuple[Proxy, str], monkeypatch: pytest.MonkeyPatch) -> None:
    proxy, url = between
    monkeypatch.setattr(engine, "CONNECT_TIMEOUT", 2)  # the least that there is
    store = SqlJobStore(url)
    store.open()
    store.add(job(), [])
    monkeypatch.setattr(bounded_connection, "ANSWER_WITHIN", 0.2)
    proxy.fall_silent()
    for call in (store.unfinished, lambda: store.add(job(), [])):
        with pytest.raises(StoreUnavailable):
            call()
    monkeypatch.undo()
    proxy.speak_again()
    until(lambda: holds(store))
    assert len(store.unfinished()) == 1
    store.close()
