"""Stores of both kinds, empty."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from duocell.service.common.database_url import sqlite_url
from duocell.service.store.engine import make_engine
from duocell.service.store.migrate import upgrade
from duocell.service.store.sql import SqlJobStore
from tests.support import postgres
from tests.support.postgres import emptied


@pytest.fixture(scope="session")
def postgres_url() -> Iterator[str]:
    """A database with tables."""
    with postgres.serving() as url:
        engine = make_engine(url)
        upgrade(engine)
        engine.dispose()
        yield url


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Of an empty database of either kind."""
    if request.param == "sqlite":
        return sqlite_url(tmp_path)
    return emptied(request.getfixturevalue("postgres_url"))


@pytest.fixture
def open_store(url: str) -> Iterator[Callable[[], SqlJobStore]]:
    """Opens the store, as often as one likes."""
    stores: list[SqlJobStore] = []

    def make() -> SqlJobStore:
        stores.append(SqlJobStore(url))
        stores[-1].open()
        return stores[-1]

    yield make
    for store in stores:
        store.close()


@pytest.fixture
def store(open_store: Callable[[], SqlJobStore]) -> SqlJobStore:
    """An open store."""
    return open_store()
