"""What it costs to take in a request of 5,000 poses, and what HTTP costs beside a solve.

    python -m bench.timings.acceptance

Prints a table: processor time of reading and checking such a body, in a process like the one where the service does it,
and of what a worker makes of what comes out; how long the event loop of a real server is held meanwhile, and how long
another client waits for an answer; the round trip of a small request over its search. Processor times hardly depend on
what else the machine does; waiting does.
"""

from __future__ import annotations

import gc
import json
import threading
import time
from collections.abc import Callable
from functools import partial
from math import cos, degrees, pi, sin
from statistics import median
from typing import Any
from urllib.request import Request, urlopen

from bench.comparison.tasks import thesis_line
from bench.timings.server import Server, request_of, serving, without_proof
from bench.trials.large_requests import cpu_of
from duocell.service.requests.accept import accept
from duocell.service.requests.prepared import read_accepted
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.settings import Limits
from duocell.service.workers import worker

POSES, TIMES, SMALL = 5000, 15, 30
"""Of a large body; times that it is taken in; small requests."""
PROBED = ("-m", "bench.timings.probed")
PAUSE = 0.3
"""s between two large bodies, in which what they left behind is cleared away."""
SETTLED = 5.0
"""s after which a server has loaded what it loads when nobody is looking."""


def large_body(mixed: bool) -> bytes:
    """Poses on a wavy line that turn about z: as quaternions, or in nine formats by turns."""
    poses = []
    for k in range(POSES):
        share = k / (POSES - 1)
        angle = 0.3 * sin(7.0 * share)
        position = [
            round(0.73 + 0.36 * share, 6),
            round(0.35 + 0.35 * share, 6),
            round(0.1 + 0.01 * sin(9.0 * share), 6),
        ]
        poses.append({"position": position, "orientation": turned(k if mixed else 0, angle)})
    return json.dumps({**EXAMPLE, "task": {"poses": poses}}).encode()


def turned(form: int, angle: float) -> dict[str, Any]:
    """A turn about z in one of the formats."""
    s, c = sin(angle), cos(angle)
    forms: tuple[dict[str, Any], ...] = (
        {"quaternion": [0.0, 0.0, sin(angle / 2.0), cos(angle / 2.0)]},
        {"matrix": [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]},
        {"rpy": [0.0, 0.0, angle]},
        {"euler_zyz": [angle, 0.0, 0.0]},
        {"oat": [angle + pi / 2.0, pi / 2.0, 0.0]},
        {"quaternion_wxyz": [cos(angle / 2.0), 0.0, 0.0, sin(angle / 2.0)]},
        {"axis_angle": [0.0, 0.0, angle]},
        {"abc_deg": [degrees(angle), 0.0, 0.0]},
        {"wpr_deg": [0.0, 0.0, degrees(angle)]},
    )
    return forms[form % len(forms)]


def cpu_times(work: Callable[[], object]) -> list[float]:
    """ms of processor time of this process, of each of `TIMES` runs."""
    found = []
    for _ in range(TIMES):
        began = time.process_time()
        work()
        found.append(1e3 * (time.process_time() - began))
    return found


def read_by_worker(body: bytes) -> Callable[[], object]:
    """What a worker does before it begins to solve."""
    accepted = accept(body, Limits())
    return lambda: read_accepted(LayoutRequest, accepted.prepared)


def held(server: Server, body: bytes) -> tuple[list[float], list[float], list[float]]:
    """ms, for each large body: the loop held (processor time), late (wall), and the longest wait for /healthz."""
    cpu, late, waits = [], [], []
    for _ in range(TIMES):
        time.sleep(PAUSE)
        get(server, "/probe")
        done = threading.Event()
        waited = [0.0]
        other = threading.Thread(target=ask_for_health, args=(server, done, waited))
        other.start()
        headers = {"Content-Type": "application/json"}
        with urlopen(Request(f"{server.url}/v1/layouts", body, headers), timeout=90.0) as answer:
            address = answer.headers["Location"]
            answer.read()
        done.set()
        other.join()
        seen = get(server, "/probe")
        with urlopen(Request(f"{server.url}{address}/cancel", b"", method="POST"), timeout=90.0):
            pass
        cpu.append(1e3 * seen["cpu"])
        late.append(1e3 * seen["late"])
        waits.append(1e3 * waited[0])
    return cpu, late, waits


def ask_for_health(server: Server, done: threading.Event, waited: list[float]) -> None:
    """The longest round trip of /healthz while something else goes on."""
    while not done.is_set():
        began = time.perf_counter()
        get(server, "/healthz")
        waited[0] = max(waited[0], time.perf_counter() - began)


def get(server: Server, path: str) -> Any:
    """The document of an address."""
    with urlopen(f"{server.url}{path}", timeout=90.0) as answer:
        return json.loads(answer.read())


def overheads(server: Server) -> tuple[list[float], float]:
    """ms, for small requests without a proof: round trips over their searches; mean processor time of the server."""
    body = without_proof(request_of(thesis_line(10)))
    server.solve(body)
    time.sleep(SETTLED)
    before, over = cpu_of(server.pid), []
    for _ in range(SMALL):
        seconds, resource = server.solve(body)
        over.append(1e3 * (seconds - resource["result"]["search"]["wall_time"]))
    return over, 1e3 * (cpu_of(server.pid) - before) / SMALL


def row(what: str, values: list[float], most: str = "") -> str:
    """Markdown."""
    return f"| {what} | {median(values):.3g} ms | {min(values):.3g} ms | {max(values):.3g} ms | {most} |"


def main() -> None:
    """Measure and print."""
    worker.self_test()  # what the processes are forked from has loaded and run everything once
    gc.collect()
    gc.freeze()
    print("| what | median | lowest | highest | target |\n|---|---|---|---|---|")
    for mixed in (False, True):
        body, kind = large_body(mixed), "nine formats" if mixed else "quaternions"
        times = cpu_times(partial(accept, body, Limits()))
        print(row(f"accept {POSES:,} poses, {kind}: processor time", times, "150 ms"))
        print(row("what a worker does before it solves them: processor time", cpu_times(read_by_worker(body))))
    with serving() as server:
        over, own = overheads(server)
    with serving(PROBED) as server:
        cpu, late, waits = held(server, large_body(mixed=True))
    print(row("event loop held meanwhile: processor time", cpu, "20 ms, each"))
    print(row("event loop late meanwhile", late, "20 ms, each"))
    print(row("longest answer of /healthz meanwhile", waits))
    print(row("HTTP with Prefer: wait, over the search", over, "8 ms"))
    print(row("processor time of the server for it, workers left out", [own]))


if __name__ == "__main__":
    main()
