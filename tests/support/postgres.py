"""A PostgreSQL for tests; without its programs they are skipped, except where a skip is a failure."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from bench.chaos import postgres


@contextmanager
def serving() -> Iterator[str]:
    """A running server without anything in it; yields its URL."""
    try:
        postgres.require()
    except FileNotFoundError as error:
        (pytest.fail if os.environ.get("DUOCELL_CI") else pytest.skip)(str(error))
    with postgres.serving() as url:
        yield url
