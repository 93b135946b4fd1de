"""The demonstration behind `make demo`: start the server, send a request over HTTP, print the answer, stop the server.

    python -m duocell.service.cli.demo [REQUEST.json]

Everything it writes goes to build/demo/. It talks to the server as any client would, with the standard library alone.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import degrees
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urljoin
from urllib.request import Request, urlopen

from rich.console import Console
from rich.table import Table
from rich.text import Text

from duocell.service.figure.figure import write_figure

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples" / "line.json"
RESULTS = Path("build/demo")
READY_WITHIN = 60.0  # s; a cold disk takes its time to load the engines
ANSWER_WITHIN = 120.0  # s

Document = dict[str, Any]


class DemoFailed(Exception):
    """Something that the demonstration cannot go on without; the message is for a person."""


def main(arguments: list[str] | None = None) -> int:
    """Run the demonstration; the exit code is 0 if the example was solved."""
    given = sys.argv[1:] if arguments is None else arguments
    request_file = Path(given[0]) if given else EXAMPLE
    console = Console()
    try:
        request = request_file.read_bytes()
        RESULTS.mkdir(parents=True, exist_ok=True)
        with serving(RESULTS / "server.log") as url:
            console.print(f"server ready on {url}; sending {shown(request_file)} ...")
            started = time.perf_counter()
            resource = solve(url, request)
            console.print(f"answer after {time.perf_counter() - started:.2f} s over HTTP: {resource['status']}")
    except (DemoFailed, OSError) as error:
        console.print(f"demo failed: {error}", style="red", markup=False, highlight=False)
        return 1
    (RESULTS / "layout.json").write_text(json.dumps(resource, indent=1) + "\n")
    if resource["status"] != "succeeded":
        console.print_json(json.dumps(resource))
        return 1
    report(console, resource)
    write_figure(resource, RESULTS / "layout.svg")
    say_where_next(console, request_file)
    return 0 if resource["result"]["outcome"] in ("optimal", "feasible") else 1


@contextmanager
def serving(log: Path) -> Iterator[str]:
    """A server of our own on a free loopback port; yields its address once it is ready, stops it in the end."""
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    command = [str(Path(sys.executable).with_name("duocell")), "serve", "--host", "127.0.0.1", "--port", str(port)]
    environment = os.environ | {"DUOCELL_DATA_DIR": str(log.parent / "data")}
    with log.open("wb") as output:
        server = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, env=environment)
    try:
        wait_until_ready(url, server, log)
        yield url
    finally:
        server.terminate()
        try:
            server.wait(15.0)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()


def free_port() -> int:
    """A port nobody listens on at the moment."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_until_ready(url: str, server: subprocess.Popen[bytes], log: Path) -> None:
    """Ask /readyz until it says yes.

    Raises:
        DemoFailed: the server ended, or is not ready in time.
    """
    deadline = time.monotonic() + READY_WITHIN
    while time.monotonic() < deadline:
        if server.poll() is not None:
            raise DemoFailed(f"the server ended with code {server.returncode}:\n{log.read_text()[-2000:]}")
        try:
            with urlopen(f"{url}/readyz", timeout=5.0):
                return
        except (URLError, TimeoutError, ConnectionError):  # not listening yet, or not ready (503)
            time.sleep(0.1)
    raise DemoFailed(f"the server is not ready after {READY_WITHIN:.0f} s; it wrote:\n{log.read_text()[-2000:]}")


def solve(url: str, request: bytes) -> Document:
    """POST the request, wait for the finished resource.

    Raises:
        DemoFailed: the server refuses the request, or does not finish in time.
    """
    headers = {"Content-Type": "application/json", "Prefer": "wait=30"}
    try:
        resource, location = fetch(Request(f"{url}/v1/layouts", request, headers))
        deadline = time.monotonic() + ANSWER_WITHIN
        while resource["status"] in ("queued", "running"):
            if time.monotonic() > deadline:
                raise DemoFailed(f"no answer after {ANSWER_WITHIN:.0f} s")
            time.sleep(0.2)
            resource, _ = fetch(Request(urljoin(url, location)))
    except HTTPError as error:
        raise DemoFailed(f"the server answered {error.code}: {error.read().decode()}") from error
    return resource


def fetch(request: Request) -> tuple[Document, str]:
    """The JSON answer and its Location header."""
    with urlopen(request, timeout=ANSWER_WITHIN) as answer:
        return json.load(answer), answer.headers.get("Location", "")


def report(console: Console, resource: Document) -> None:
    """Where to bolt down the arms, in the units of the shop floor."""
    result = resource["result"]
    table = Table(title=Text(f"{resource['request'].get('name') or 'layout'}: {result['outcome']}"))
    for heading in ("arm", "x, mm", "y, mm", "z, mm", "yaw, °", "smallest margin, °", "objective"):
        table.add_column(heading, justify="left" if heading == "arm" else "right")
    for arm in result["arms"]:
        millimetres = [f"{1000.0 * value:.1f}" for value in arm["base"]["position"]]
        margin = "none" if arm["minimum_margin"] is None else f"{degrees(arm['minimum_margin']):.1f}"
        yaw = f"{degrees(arm['base']['yaw']):.2f}"
        table.add_row(Text(arm["name"]), *millimetres, yaw, margin, f"{arm['objective']:.3f}")
    console.print(table)
    for reason in result.get("reasons", []):
        console.print(f"  {reason['arm']}: {reason['detail']}", markup=False)


def say_where_next(console: Console, request_file: Path) -> None:
    """What to open and what to type."""
    console.print("Where to look next:")
    for line in (
        f"{RESULTS / 'layout.svg'}: the floor plan",
        f"{RESULTS / 'layout.json'}: the whole answer, with the joints at every pose, margins and verification",
        f".venv/bin/duocell solve {shown(request_file)}: the same without a server",
        ".venv/bin/duocell robots: the arms that can be asked for",
        "make serve: the server; its page /docs describes every request and sends it",
    ):
        console.print(f"  {line}", markup=False, highlight=False, soft_wrap=True)


def shown(path: Path) -> str:
    """A path as the user would type it."""
    try:
        return str(path.resolve().relative_to(Path.cwd()))
    except ValueError:
        return str(path)


if __name__ == "__main__":
    raise SystemExit(main())
