"""Servers of our own, as they are started on a command line."""

import socket
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

import pytest

from duocell.service.cli.demo import serving
from duocell.service.http.keys import hash_line, new_key


class Server(NamedTuple):
    """Where it is, a key of it, and what it writes."""

    url: str
    key: str
    log: Path

    def connect(self) -> socket.socket:
        address = urlsplit(self.url)
        return socket.create_connection((address.hostname, address.port), timeout=20.0)


@contextmanager
def guarded_server(log: Path, environment: Mapping[str, str]) -> Iterator[Server]:
    """A server with one key; the environment is its own alone."""
    key = new_key()
    with ExitStack() as stack:
        with pytest.MonkeyPatch.context() as patch:
            for name, value in {**environment, "DUOCELL_API_KEYS": hash_line("client", key)}.items():
                patch.setenv(name, value)
            url = stack.enter_context(serving(log))
        yield Server(url, key, log)
