"""A server of our own on a free loopback port, watched: when it is ready, how fast it answers, what its workers use."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, sleep
from typing import Any
from urllib.error import URLError
from urllib.request import Request, urlopen

from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.service.cli.demo import free_port

READY_WITHIN = 60.0
"""s"""


@dataclass(frozen=True, slots=True)
class Server:
    """A running server.

    Attributes:
        url: its address. pid: of the process. ready_after: s from its start to the first good answer of /readyz.
    """

    url: str
    pid: int
    ready_after: float

    def solve(self, body: bytes) -> tuple[float, dict[str, Any]]:
        """(seconds of the round trip, finished resource) of one request with ``Prefer: wait``."""
        return self.send("/v1/layouts", body)

    def send(self, address: str, body: bytes) -> tuple[float, dict[str, Any]]:
        """(seconds of the round trip, answer) of a POST, with ``Prefer: wait``."""
        headers = {"Content-Type": "application/json", "Prefer": "wait=60"}
        began = perf_counter()
        with urlopen(Request(self.url + address, body, headers), timeout=90.0) as answer:
            text = answer.read()
        seconds = perf_counter() - began
        return seconds, json.loads(text)

    def peak_memory(self) -> int:
        """Bytes: largest resident set that any process started by the server ever had."""
        return max(_peak(pid) for pid in descendants(self.pid))


@contextmanager
def serving(program: Sequence[str] = ()) -> Iterator[Server]:
    """Start a server, wait until it is ready, stop it in the end.

    Args:
        program: arguments of Python, in place of `duocell serve`, that start it; host and port follow.

    Raises:
        RuntimeError: it ended, or is not ready in time.
    """
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    duocell = str(Path(sys.executable).with_name("duocell"))
    command = [duocell, "serve", "--host", "127.0.0.1", "--port", str(port)]
    if program:
        command = [sys.executable, *program, "127.0.0.1", str(port)]
    with tempfile.TemporaryDirectory() as folder, Path(folder, "log").open("w+b") as log:
        began = perf_counter()
        process = subprocess.Popen(
            command, stdout=log, stderr=subprocess.STDOUT, env=os.environ | {"DUOCELL_DATA_DIR": folder}
        )
        try:
            while not _ready(url):
                if process.poll() is not None or perf_counter() - began > READY_WITHIN:
                    log.seek(0)
                    raise RuntimeError(f"the server did not get ready:\n{log.read().decode()[-2000:]}")
                sleep(0.02)
            yield Server(url, process.pid, perf_counter() - began)
        finally:
            process.terminate()
            try:
                process.wait(15.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def request_of(cell: Cell) -> bytes:
    """The cell as a body for ``POST /v1/layouts``."""

    def pose(matrix: Any) -> dict[str, Any]:
        return {"position": matrix[:3, 3].tolist(), "orientation": {"matrix": matrix[:3, :3].tolist()}}

    def interval(low: float, high: float) -> float | list[float]:
        return low if low == high else [low, high]

    arms = [
        {
            "name": arm.name,
            "robot": arm.robot.name,
            "tool": pose(arm.tool),
            "grasp": pose(arm.grasp),
            "base": dict(
                zip(("x", "y", "z", "yaw"), (interval(*row) for row in arm.base.bounds.tolist()), strict=True)
            ),
            "reference": arm.reference.tolist(),
            "weights": arm.weights.tolist(),
        }
        for arm in cell.arms
    ]
    poses = [pose(transform(p[:3, :3], p[:3, 3])) for p in cell.task.poses]
    return json.dumps({"task": {"poses": poses}, "arms": arms, "max_joint_step": cell.max_joint_step}).encode()


def without_proof(body: bytes) -> bytes:
    """A body that asks for no certificate: the time of one is not that of the search."""
    return json.dumps(json.loads(body) | {"certificate": None}).encode()


def _ready(url: str) -> bool:
    try:
        with urlopen(f"{url}/readyz", timeout=5.0):
            return True
    except (URLError, TimeoutError, ConnectionError):  # not listening yet, or not ready (503)
        return False


def descendants(pid: int) -> list[int]:
    """Processes started by ``pid``, directly or not (Linux)."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            except OSError:  # it has ended meanwhile
                continue
            parents[int(entry.name)] = int(fields[1])
    found = {pid}
    while True:
        more = {child for child, parent in parents.items() if parent in found} - found
        if not more:
            return sorted(found - {pid})
        found |= more


def _peak(pid: int) -> int:
    """VmHWM of a process, bytes; 0 if it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM")), 0)
