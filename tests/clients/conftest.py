"""A server for clients: it asks for a key, and its solves are cheap."""

from collections.abc import Iterator

import pytest

from tests.clients.fuzz import CHEAP
from tests.support.guarded import Server, guarded_server

PATIENT = CHEAP | {"DUOCELL_TIME_LIMIT": "20"}
"""On a busy machine, too, a small layout is found."""


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """For clients that mean well; fuzzing fills the queue of its own server."""
    with guarded_server(tmp_path_factory.mktemp("clients") / "log", PATIENT) as server:
        yield server
