"""Servers of our own on loopback, and how they are asked."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

from duocell.service.cli.demo import free_port

SOURCES = Path(os.environ.get("DUOCELL_CHAOS_SOURCES", Path(__file__).parents[2]))
"""Which sources the servers run; another folder shows what an older version does."""
ENTRY = "service.cli" if (SOURCES / "service" / "cli.py").exists() else "duocell.service.cli.main"
"""What is run as a command; older versions have one file of it."""
READY_WITHIN = 240.0
"""s; machines that try this are busy."""


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer: status (0: none), document or text, s that it took, headers."""

    status: int
    body: Any
    seconds: float
    headers: dict[str, str]


class Server:
    """`duocell serve` with a folder and settings of its own."""

    def __init__(
        self,
        folder: Path,
        *,
        before: tuple[str, ...] = (),
        stderr: Any = None,
        settings: Mapping[str, str] | None = None,
    ) -> None:
        self.folder = folder
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._before = before
        self._stderr = stderr
        self._settings = {"DUOCELL_DATA_DIR": str(folder), "DUOCELL_WORKERS": "1", "OMP_NUM_THREADS": "1"}
        self._settings |= settings or {}
        self.process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """Of the server itself, also where a wrapper has started it."""
        if self.process is None:
            raise RuntimeError("it was not started")
        return self.process.pid

    def start(self, *, wait: bool = True) -> None:
        """Start it, and return when it is ready to solve.

        Raises:
            RuntimeError: it does not get ready.
        """
        command = [*self._before, sys.executable, "-m", ENTRY, "serve", "--port", str(self.port)]
        self.folder.mkdir(parents=True, exist_ok=True)
        with Path(f"{self.folder}.log").open("ab") as log:
            self.process = subprocess.Popen(
                command,
                cwd=SOURCES,
                env=os.environ | {"PYTHONPATH": f"{SOURCES / 'src'}{os.pathsep}{SOURCES}"} | self._settings,
                stdout=log,
                stderr=log if self._stderr is None else self._stderr,
            )
        if wait:
            until(lambda: self.get("/readyz").status == 200, READY_WITHIN, "a server that is ready")

    def get(self, path: str, timeout: float = 90.0) -> Reply:
        """Ask for something."""
        return self.ask("GET", path, None, timeout)

    def post(self, document: Any, timeout: float = 90.0, path: str = "/v1/layouts", **headers: str) -> Reply:
        """Send a document."""
        return self.ask("POST", path, json.dumps(document).encode(), timeout, **headers)

    def ask(self, method: str, path: str, body: bytes | None, timeout: float = 90.0, **headers: str) -> Reply:
        """Any request; names of headers are written with underscores."""
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        sent = Request(self.url + path, body, {"Content-Type": "application/json"} | named, method=method)
        began = time.monotonic()
        try:
            with urlopen(sent, timeout=timeout) as answer:
                status, text, received = answer.status, answer.read(), dict(answer.headers)
        except HTTPError as error:
            status, text, received = error.code, error.read(), dict(error.headers)
        except (URLError, TimeoutError, OSError):
            status, text, received = 0, b"", {}
        seconds = time.monotonic() - began
        with suppress(ValueError):
            return Reply(status, json.loads(text), seconds, received)
        return Reply(status, text.decode(errors="replace"), seconds, received)

    def finished(self, location: str, seconds: float = 120.0) -> Any:
        """The layout once it is finished, or as it is after a time."""
        ends = time.monotonic() + seconds
        while True:
            found = self.get(location).body
            if not isinstance(found, dict) or found.get("status") not in ("queued", "running"):
                return found
            if time.monotonic() > ends:
                return found
            time.sleep(0.05)

    def kill(self) -> None:
        """End it without a word."""
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def stop(self) -> float:
        """Tell it to end; s that it took, killed after 30."""
        began = time.monotonic()
        if self.process is not None and self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(30.0)
            except subprocess.TimeoutExpired:
                self.kill()
        return time.monotonic() - began

    def children(self) -> dict[int, str]:
        """Processes that it has started, directly or not, with their command lines."""
        return {pid: command_line(pid) for pid in descendants(self.pid)}


@contextmanager
def running(folder: Path, settings: Mapping[str, str] | None = None) -> Iterator[Server]:
    """A server that is ready, and gone in the end."""
    server = Server(folder, settings=settings)
    try:
        server.start()
        yield server
    finally:
        for pid in server.children() if server.process is not None else ():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        server.stop()


def until(condition: Callable[[], Any], seconds: float, what: str) -> float:
    """Wait for a condition; s that it took.

    Raises:
        RuntimeError: it did not come true.
    """
    began = time.monotonic()
    while not condition():
        if time.monotonic() - began > seconds:
            raise RuntimeError(f"{what}: not within {seconds:g} s")
        time.sleep(0.05)
    return time.monotonic() - began


def descendants(pid: int) -> list[int]:
    """Processes started by a process, directly or not, parents first."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                parents[int(entry.name)] = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
    found, fresh = [], [pid]
    while fresh:
        fresh = [child for child, parent in parents.items() if parent in fresh]
        found += fresh
    return found


def command_line(pid: int) -> str:
    """How a process was started; "" if it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


def request(poses: int = 3, name: str = "", arms: int = 1, **more: Any) -> dict[str, Any]:
    """A request that takes the longer the more poses it has."""
    from duocell.service.schemas.request import EXAMPLE

    made: dict[str, Any] = json.loads(json.dumps(EXAMPLE))
    made |= {"name": name, "certificate": None, "arms": made["arms"][:arms]} | more
    made["task"]["line"]["count"] = poses
    return made
