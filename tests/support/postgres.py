"""A PostgreSQL for tests; without its programs they are skipped, except where a skip is a failure."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from sqlalchemy import text

from bench.chaos import postgres
from duocell.service.store.engine import make_engine


@contextmanager
def serving() -> Iterator[str]:
    """A running server without anything in it; yields its URL."""
    try:
        postgres.require()
    except FileNotFoundError as error:
        (pytest.fail if os.environ.get("DUOCELL_CI") else pytest.skip)(str(error))
    with postgres.serving() as url:
        yield url


def emptied(url: str) -> str:
    """The same URL, when no jobs are in its database any more and nobody has taken it."""
    engine = make_engine(url)
    with engine.begin() as connection:
        connection.execute(text("TRUNCATE jobs, events"))
        connection.execute(text("UPDATE lease SET owner = NULL"))
    engine.dispose()
    return url
