"""Servers for clients: they ask for a key, and their solves are cheap."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from service.demo import serving
from service.keys import hash_line, new_key
from tests.clients.fuzz import CHEAP


class Server(NamedTuple):
    """Where it is, and a key of it."""

    url: str
    key: str
    log: Path


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """For clients that mean well; fuzzing fills the queue of its own server."""
    yield from started(tmp_path_factory.mktemp("clients") / "log")


def started(log: Path) -> Iterator[Server]:
    """A server of our own with cheap solves and one key."""
    key = new_key()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in CHEAP.items():
            patch.setenv(name, value)
        patch.setenv("DUOCELL_API_KEYS", hash_line("client", key))
        with serving(log) as url:
            yield Server(url, key, log)
