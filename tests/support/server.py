"""A real server in a process of its own, on loopback, to be treated badly."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.error import URLError
from urllib.request import urlopen

import httpx2

from duocell.service.cli.demo import free_port

Document = dict[str, Any]
REPOSITORY = Path(__file__).parents[2]
READY_WITHIN = 240.0
"""s; machines that test are busy."""


class Server:
    """`duocell serve` on a folder; it can be killed and started again.

    Attributes:
        url: its address, the same after every start.
    """

    def __init__(self, folder: Path, **settings: str) -> None:
        self._port = free_port()
        self._log = folder / "server.log"
        self.folder = folder / "data"
        self._environment = {"DUOCELL_DATA_DIR": str(self.folder), "OMP_NUM_THREADS": "1"} | settings
        self.url = f"http://127.0.0.1:{self._port}"
        self.process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        assert self.process is not None
        return self.process.pid

    def start(self) -> None:
        """Start it; it does not listen yet."""
        command = [sys.executable, "-m", "duocell.service.cli.main", "serve", "--port", str(self._port)]
        with self._log.open("ab") as log:
            self.process = subprocess.Popen(
                command, cwd=REPOSITORY, env=os.environ | self._environment, stdout=log, stderr=subprocess.STDOUT
            )

    def answers(self, path: str = "/readyz") -> bool:
        """Whether it says yes there."""
        try:
            with urlopen(f"{self.url}{path}", timeout=5.0):
                return True
        except (URLError, TimeoutError, ConnectionError):
            return False

    def wait_until_ready(self, path: str = "/readyz") -> None:
        """Return when it is ready to solve."""
        ends = time.monotonic() + READY_WITHIN
        while not self.answers(path):
            assert self.process is not None
            assert self.process.poll() is None, self.log()
            assert time.monotonic() < ends, self.log()
            time.sleep(0.05)

    def kill(self) -> None:
        """End it without a word; returns when it is gone."""
        assert self.process is not None
        self.process.kill()
        self.process.wait()

    def terminate(self) -> tuple[int, float]:
        """Tell it to stop; its exit code, and s that it took."""
        assert self.process is not None
        began = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(60.0), time.monotonic() - began

    def log(self) -> str:
        """The end of what it wrote."""
        return self._log.read_text(errors="replace")[-4000:]

    def client(self) -> httpx2.Client:
        """A client of it."""
        return httpx2.Client(base_url=self.url, timeout=120.0, verify=False)  # nothing is encrypted on loopback

    def workers(self) -> set[int]:
        """Process ids of its workers: what was forked by the process that it has started for this."""
        return {pid for forker in children(self.pid) for pid in children(forker)}


@contextmanager
def serving(folder: Path, **settings: str) -> Iterator[Server]:
    """A server that is ready, and gone in the end."""
    server = Server(folder, **settings)
    server.start()
    try:
        server.wait_until_ready()
        yield server
    finally:
        if server.process is not None and server.process.poll() is None:
            server.kill()


def stat(pid: int) -> list[str]:
    """The fields of /proc/PID/stat from the state on; empty if there is no such process."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return []


def children(pid: int) -> set[int]:
    """Processes whose parent is ``pid``."""
    every = (int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit())
    return {child for child in every if (fields := stat(child)) and int(fields[1]) == pid}


def alive(pid: int) -> bool:
    """Whether a process is there; zombies are not."""
    fields = stat(pid)
    return bool(fields) and fields[0] != "Z"


def cpu_time(pid: int) -> int:
    """Ticks that a process has used."""
    fields = stat(pid)
    return int(fields[11]) + int(fields[12]) if fields else 0


def has(client: httpx2.Client, location: str, field: str, wanted: object) -> Callable[[], bool]:
    """Whether a field of a resource has the value that is wanted; something to wait for with `until`."""
    return lambda: bool(client.get(location).json()[field] == wanted)


def state_of(client: httpx2.Client, location: str) -> str:
    """The state of a job."""
    return str(client.get(location).json()["status"])


def until(condition: Callable[[], object], seconds: float = 60.0, what: str = "it") -> None:
    """Return when a condition holds."""
    ends = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < ends, f"{what} did not happen"
        time.sleep(0.02)


def line_request(poses: int, name: str = "", arms: int = 1, **more: Any) -> Document:
    """A request that is solved the more slowly the more poses it has."""
    from duocell.service.schemas.request import EXAMPLE

    request: Document = json.loads(json.dumps(EXAMPLE))
    request |= {"name": name, "certificate": None, "arms": request["arms"][:arms]} | more
    request["task"]["line"]["count"] = poses
    return request


def finished(client: httpx2.Client, location: str, seconds: float = 120.0) -> Document:
    """The resource once it is finished."""
    ends = time.monotonic() + seconds
    while True:
        resource: Document = client.get(location).json()
        if resource["status"] not in ("queued", "running"):
            return resource
        assert time.monotonic() < ends, resource["status"]
        time.sleep(0.05)


def events_of(client: httpx2.Client, location: str) -> list[tuple[int, str, Document]]:
    """(number, kind, data) of all events of a finished job."""
    with client.sse(f"{location}/events") as stream:
        return [(int(event.id), event.event, json.loads(event.data)) for event in stream if event.id]
