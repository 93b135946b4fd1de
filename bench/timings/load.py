"""Load: clients that send the line of the source without a pause, and what the service makes of it.

    python -m bench.timings.load [--clients 8] [--seconds 60]

One server of our own on loopback, its clients in this process. Prints throughput, latencies, memory over time, and how
long GET /healthz took meanwhile.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

import httpx2
import numpy as np

from bench.comparison.tasks import thesis_line
from bench.timings.server import Server, descendants, request_of, serving

WARM_UP = 5.0
"""s before anything is counted."""
LOOK_EVERY = 0.05
"""s between looks at /healthz."""
WEIGH_EVERY = 5.0
"""s between looks at the memory."""


@dataclass(slots=True)
class Log:
    """What was measured.

    Attributes:
        solves, looks: s of every round trip. memory: (s, bytes of the server, bytes of all its processes).
        errors: of answers that were not a layout.
    """

    solves: list[float] = field(default_factory=list)
    looks: list[float] = field(default_factory=list)
    memory: list[tuple[float, int, int]] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)


async def load(server: Server, clients: int, seconds: float) -> Log:
    """Send for ``WARM_UP`` s, and then measured for ``seconds`` s."""
    log, body = Log(), request_of(thesis_line(10))
    began = perf_counter() + WARM_UP
    ends = began + seconds
    limits = httpx2.Limits(max_connections=clients + 2)
    async with httpx2.AsyncClient(base_url=server.url, timeout=90.0, limits=limits) as client:
        senders = [_send(client, body, began, ends, log) for _ in range(clients)]
        await asyncio.gather(*senders, _look(client, began, ends, log), _weigh(server, began, ends, log))
    return log


async def _send(client: httpx2.AsyncClient, body: bytes, began: float, ends: float, log: Log) -> None:
    headers = {"Content-Type": "application/json", "Prefer": "wait=60"}
    while (start := perf_counter()) < ends:
        answer = await client.post("/v1/layouts", content=body, headers=headers)
        if answer.status_code != 200 or answer.json()["result"]["outcome"] != "optimal":
            log.errors.append(f"{answer.status_code}: {answer.text[:200]}")
        elif start >= began:
            log.solves.append(perf_counter() - start)


async def _look(client: httpx2.AsyncClient, began: float, ends: float, log: Log) -> None:
    while (start := perf_counter()) < ends:
        answer = await client.get("/healthz")
        if answer.status_code != 200:
            log.errors.append(f"healthz {answer.status_code}")
        elif start >= began:
            log.looks.append(perf_counter() - start)
        await asyncio.sleep(LOOK_EVERY)


async def _weigh(server: Server, began: float, ends: float, log: Log) -> None:
    while (now := perf_counter()) < ends:
        if now >= began:
            processes = [server.pid, *descendants(server.pid)]
            log.memory.append((now - began, _private(server.pid), sum(_private(pid) for pid in processes)))
        await asyncio.sleep(WEIGH_EVERY)


def _private(pid: int) -> int:
    """Bytes that would be free without this process: what it shares with others is not counted."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) * 1024 for line in lines if line.startswith(("Private_Clean", "Private_Dirty")))


def report(log: Log, clients: int, seconds: float) -> str:
    """Markdown."""
    lines = [
        f"{clients} clients for {seconds:g} s: {len(log.solves)} layouts, {len(log.solves) / seconds:.1f} a second, "
        f"{len(log.errors)} errors",
        "",
        "| | median | 95 % | 99 % | worst |",
        "|---|---|---|---|---|",
    ]
    for what, times in (("POST /v1/layouts, Prefer: wait", log.solves), ("GET /healthz meanwhile", log.looks)):
        values = [*np.percentile(times, [50, 95, 99]), max(times)]
        lines.append(f"| {what} | {' | '.join(f'{1e3 * value:.0f} ms' for value in values)} |")
    lines += ["", "| after | server | all processes |", "|---|---|---|"]
    for moment, server, everything in log.memory[:: max(1, len(log.memory) // 6)]:
        lines.append(f"| {moment:.0f} s | {server / 1e6:.0f} MB | {everything / 1e6:.0f} MB |")
    return "\n".join(lines)


def main() -> int:
    """Measure and print; the exit code is 0 if every answer was a layout."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--clients", type=int, default=8)
    options.add_argument("--seconds", type=float, default=60.0)
    given = options.parse_args()
    with serving() as server:
        log = asyncio.run(load(server, given.clients, given.seconds))
    print(report(log, given.clients, given.seconds))
    for error in log.errors[:10]:
        print(error, file=sys.stderr)
    return 1 if log.errors else 0


if __name__ == "__main__":
    raise SystemExit(main())
