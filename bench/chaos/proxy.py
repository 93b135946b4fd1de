"""A proxy before PostgreSQL that loses answers, falls silent, or cuts connections, when it is told to."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

CHUNK = 65536
PORT = 5432


class Proxy:
    """Listens on a loopback port of its own and passes everything on to the socket of a PostgreSQL server.

    Attributes:
        port: where it listens. lost: answers to COMMIT that were not passed on.
    """

    def __init__(self, folder: str) -> None:
        self._upstream = f"{folder}/.s.PGSQL.{PORT}"
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listener.getsockname()[1])
        self._pairs: set[tuple[socket.socket, socket.socket]] = set()
        self._lock = threading.Lock()
        self._silent = threading.Event()
        self._statement: bytes | None = None
        self.lost = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def lose_commit_of(self, statement: bytes) -> None:
        """Cut the connection after the next COMMIT that follows a statement was carried out, before its answer."""
        self._statement = statement

    def fall_silent(self) -> None:
        """Pass nothing on any more, in either direction, but keep all connections and take new ones."""
        self._silent.set()

    def speak_again(self) -> None:
        """End the silence; connections that met it are cut."""
        self._silent.clear()
        self.cut()

    def cut(self) -> None:
        """End all connections."""
        with self._lock:
            pairs = list(self._pairs)
        for pair in pairs:
            self._end(pair)

    def close(self) -> None:
        """End everything."""
        self._silent.clear()
        self._listener.close()
        self.cut()

    def _accept(self) -> None:
        with suppress(OSError):  # closed
            while True:
                client, _ = self._listener.accept()
                server = socket.socket(socket.AF_UNIX)
                try:
                    server.connect(self._upstream)
                except OSError:
                    client.close()
                    continue
                pair = client, server
                with self._lock:
                    self._pairs.add(pair)
                loses = threading.Event()
                threading.Thread(target=self._forward, args=(pair, loses), daemon=True).start()
                threading.Thread(target=self._back, args=(pair, loses), daemon=True).start()

    def _forward(self, pair: tuple[socket.socket, socket.socket], loses: threading.Event) -> None:
        """From the client to the server."""
        client, server = pair
        chosen = False
        with suppress(OSError):
            while data := client.recv(CHUNK):
                self._wait()
                wanted = self._statement
                if wanted is not None and wanted in data:
                    chosen = True
                if chosen and b"COMMIT" in data:
                    self._statement = None
                    loses.set()
                server.sendall(data)
        self._end(pair)

    def _back(self, pair: tuple[socket.socket, socket.socket], loses: threading.Event) -> None:
        """From the server to the client."""
        client, server = pair
        with suppress(OSError):
            while data := server.recv(CHUNK):
                self._wait()
                if loses.is_set():
                    self.lost += 1
                    break
                client.sendall(data)
        self._end(pair)

    def _wait(self) -> None:
        while self._silent.is_set():
            threading.Event().wait(0.05)

    def _end(self, pair: tuple[socket.socket, socket.socket]) -> None:
        with self._lock:
            self._pairs.discard(pair)
        for one in pair:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()


@contextmanager
def proxied(url: str) -> Iterator[tuple[Proxy, str]]:
    """A proxy before the server of a URL as `bench.chaos.postgres.serving` gives it, and the URL through the proxy."""
    proxy = Proxy(url.rpartition("host=")[2])
    try:
        yield proxy, f"postgresql://duocell@127.0.0.1:{proxy.port}/postgres?sslmode=disable&gssencmode=disable"
    finally:
        proxy.close()
