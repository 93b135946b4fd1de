"""The disk is full, or the folder cannot be used: clear answers meanwhile, nothing broken, all well afterwards."""

import resource
import sqlite3
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

import pytest

from tests.support.server import Server, finished, line_request, serving, until

FULL = 8192
"""bytes: no file of the server may become longer than this while its disk is "full"."""


@contextmanager
def limited(server: Server) -> Iterator[tuple[Callable[[], None], Callable[[], None]]]:
    """A disk that is full for the server alone: the kernel refuses to let its files grow."""
    soft, hard = resource.prlimit(server.pid, resource.RLIMIT_FSIZE)

    def let(size: int) -> None:
        resource.prlimit(server.pid, resource.RLIMIT_FSIZE, (size, hard))

    yield partial(let, FULL), partial(let, soft)


def test_a_full_disk(tmp_path: Path) -> None:
    with serving(tmp_path, DUOCELL_WORKERS="1") as server, server.client() as client, limited(server) as (stuff, free):
        before = client.post("/v1/layouts", json=line_request(3), headers={"Prefer": "wait=60"}).json()
        running = client.post("/v1/layouts", json=line_request(150, arms=2)).headers["location"]
        stuff()
        refused = client.post("/v1/layouts", json=line_request(3))
        assert refused.status_code == 503
        assert refused.json()["code"] == "store-unavailable"
        assert int(refused.headers["retry-after"]) >= 1
        until(lambda: client.get("/readyz").status_code == 503, 30.0, "the notice")
        assert client.get("/readyz").json()["detail"].startswith("store: ")
        assert client.get("/healthz").status_code == 200
        assert client.get(f"/v1/layouts/{before['id']}").json() == before
        assert client.delete(f"/v1/layouts/{before['id']}").status_code == 503
        time.sleep(3.0)  # the running one ends meanwhile, and cannot say so
        assert client.get(running).json()["status"] == "running"
        free()
        until(lambda: client.get("/readyz").status_code == 200, 30.0, "the recovery")
        assert finished(client, running)["status"] == "succeeded"
        after = client.post("/v1/layouts", json=line_request(3), headers={"Prefer": "wait=60"})
        assert after.json()["status"] == "succeeded"
        assert after.json()["result"]["objective"] == before["result"]["objective"]
        assert len(client.get("/v1/layouts").json()["items"]) == 3  # the refused one is nowhere
    connection = sqlite3.connect(server.folder / "duocell.sqlite3")
    assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    connection.close()


def mountable(folder: Path) -> bool:
    """Whether this process may mount a file system."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    return subprocess.run(command, capture_output=True).returncode == 0


def fill(file: Path) -> None:
    """Write until nothing more fits."""
    with file.open("wb", buffering=0) as stream, suppress(OSError):
        while stream.write(bytes(4096)) == 4096:
            pass


def test_a_file_system_that_is_really_full(tmp_path: Path) -> None:
    server = Server(tmp_path, DUOCELL_WORKERS="1")
    if not mountable(server.folder):
        pytest.skip("only root may mount; the test above does without")
    try:
        server.start()
        server.wait_until_ready()
        filler = server.folder / "filler"
        with server.client() as client:
            before = client.post("/v1/layouts", json=line_request(3), headers={"Prefer": "wait=60"}).json()
            fill(filler)
            refused = [client.post("/v1/layouts", json=line_request(300, "x" * 60)).status_code for _ in range(40)]
            assert refused[-1] == 503
            assert set(refused) <= {202, 429, 503}
            until(lambda: client.get("/readyz").status_code == 503, 30.0, "the notice")
            assert "full" in client.get("/readyz").json()["detail"]
            assert client.get(f"/v1/layouts/{before['id']}").json()["status"] == "succeeded"
            filler.unlink()
            until(lambda: client.get("/readyz").status_code == 200, 30.0, "the recovery")
            after = client.post("/v1/layouts", json=line_request(3), headers={"Prefer": "wait=60"}).json()
            assert after["status"] == "succeeded"
            taken = refused.count(202)
            assert len(client.get("/v1/layouts?limit=100").json()["items"]) == taken + 2
    finally:
        if server.process is not None:
            server.kill()
        connection = sqlite3.connect(server.folder / "duocell.sqlite3")
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        connection.close()
        subprocess.run(["umount", str(server.folder)], check=True)


def test_a_folder_that_cannot_be_used(tmp_path: Path) -> None:
    server = Server(tmp_path, DUOCELL_WORKERS="1")
    server.folder.write_text("a file where the folder should be")
    server.start()
    try:
        server.wait_until_ready("/healthz")
        with server.client() as client:
            answer = client.get("/readyz")
            assert answer.status_code == 503
            assert str(server.folder) in answer.json()["detail"]
            assert client.post("/v1/layouts", json=line_request(3)).json()["code"] == "store-unavailable"
            server.folder.unlink()
            until(lambda: client.get("/readyz").status_code == 200, 60.0, "the recovery")
            answer = client.post("/v1/layouts", json=line_request(3), headers={"Prefer": "wait=60"})
            assert answer.json()["status"] == "succeeded"
    finally:
        server.kill()
