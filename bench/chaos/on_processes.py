"""Faults of processes and pipes, and requests as large as they may be."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
import uuid
from contextlib import suppress
from typing import Any

from bench.chaos.on_postgres import wait_for
from bench.chaos.on_sqlite import upload_mesh
from bench.chaos.server import Server, request, running, until
from bench.chaos.trial import Finding, Setup

KILLS, JOBS = 6, 24
REQUESTS = 400
"""With a log pipe that nobody reads."""


def kills(setup: Setup) -> Finding:
    """The server is ended again and again while clients send, each request until it is acknowledged."""
    server = Server(setup.folder, settings=setup.settings)
    draws = random.Random(1)
    locations: dict[int, str] = {}

    def send(numbers: list[int]) -> None:
        for number in numbers:
            key = uuid.uuid4().hex
            while number not in locations:
                answer = server.post(request(3 + number % 5, f"job {number}"), 10.0, Idempotency_Key=key)
                if answer.status in (200, 202):
                    locations[number] = answer.headers["location"]
                time.sleep(0.1)

    try:
        server.start()
        threads = [threading.Thread(target=send, args=(list(range(k, JOBS, 4)),)) for k in range(4)]
        for thread in threads:
            thread.start()
        for _ in range(KILLS):
            time.sleep(draws.uniform(0.2, 1.5))
            server.kill()
            server.start(wait=False)
            until(lambda: server.get("/healthz").status == 200, 120.0, "the next start")
        for thread in threads:
            thread.join()
        until(lambda: server.get("/readyz").status == 200, 120.0, "the end of the kills")
        states = [server.finished(location).get("status") for location in locations.values()]
        names = [item["name"] for item in server.get("/v1/layouts?limit=100").body["items"]]
    finally:
        server.stop()
    done, twice = states.count("succeeded"), len(names) - len(set(names))
    return Finding(done == JOBS and not twice, f"{KILLS} kills, {done} of {JOBS} acknowledged succeeded, {twice} twice")


def uploads(setup: Setup) -> Finding:
    """Every process that only waits is killed, among them the one that reads uploads."""
    with running(setup.folder) as server:
        first = upload_mesh(server, "one")
        for pid in server.children():
            if pid in grandchildren(server):
                os.kill(pid, signal.SIGKILL)
        time.sleep(1.0)
        more = [upload_mesh(server, "two" + "x" * number) for number in range(3)]
        layout = server.finished(server.post(request(3)).headers.get("location", "/none"), 60.0)
    good = sum(len(one) > 20 and "{" not in one for one in more)
    kept = good == 3 and len(first) > 20 and layout.get("status") == "succeeded"
    return Finding(kept, f"{good} of 3 uploads read afterwards, a layout {layout.get('status')}")


def grandchildren(server: Server) -> set[int]:
    """Workers: what was forked by the process that the server has started for this."""
    children = server.children()
    forkers = {pid for pid, line in children.items() if "forkserver" in line}
    return {pid for pid in children if parent(pid) in forkers}


def parent(pid: int) -> int:
    """Of a process; 0 if it has ended."""
    with suppress(OSError), open(f"/proc/{pid}/stat") as file:
        return int(file.read().rsplit(")", 1)[1].split()[1])
    return 0


def _upload_into(answers: list[str], server: Server, name: str) -> None:
    """The work of a thread: what an upload is answered."""
    answers.append(upload_mesh(server, name))


def fork_server(setup: Setup) -> Finding:
    """The process that all others are forked from is killed; its successor is stopped, and the workers are killed."""
    with running(setup.folder) as server:
        seen: list[str] = []
        kept = True
        for number in (signal.SIGKILL, signal.SIGSTOP):
            forkers = [
                pid for pid, line in server.children().items() if "forkserver" in line and parent(pid) == server.pid
            ]
            workers = grandchildren(server)
            for pid in forkers:
                os.kill(pid, number)
            for pid in workers:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            began = time.monotonic()
            mesh: list[str] = []
            thread = threading.Thread(target=_upload_into, args=(mesh, server, "m" * len(seen) + "x"))
            thread.start()
            health = 0.0
            while time.monotonic() - began < 5.0:
                health = max(health, server.get("/healthz", 30.0).seconds)
                time.sleep(0.05)
            thread.join()
            layout = server.finished(server.post(request(3)).headers.get("location", "/none"), 90.0)
            again = wait_for(lambda: server.get("/readyz").status == 200, 120.0)
            good = len(mesh[0]) > 20 and "{" not in mesh[0]
            kept = kept and good and layout.get("status") == "succeeded" and health < 1.0 and again < 120.0
            seen.append(
                f"{number.name}: upload {'read' if good else 'refused'}, layout {layout.get('status')}, /healthz "
                f"{1e3 * health:.0f} ms"
            )
    return Finding(kept, "; ".join(seen))


def log_pipe(setup: Setup) -> Finding:
    """The log goes into a pipe that nobody reads."""
    reader, writer = os.pipe()
    server = Server(setup.folder, stderr=writer)
    try:
        server.start()
        os.close(writer)
        answered = 0
        for number in range(REQUESTS):
            answered += server.get(f"/v1/layouts/{number:032x}", 5.0).status == 404
            if answered < number - 3:
                break
        health = server.get("/healthz", 5.0).status
        seconds = server.stop()
    finally:
        server.kill()
        os.close(reader)
    kept = answered == REQUESTS and health == 200 and seconds < 15.0
    return Finding(
        kept, f"{answered} of {REQUESTS} requests answered, /healthz {health or 'silent'}, ended in {seconds:.0f} s"
    )


def soft_limits(setup: Setup) -> Finding:
    """Requests as large as they may be, with a limit of five seconds, one after the other."""
    words: dict[str, int] = {}
    slowest, failed = 0.0, 0
    with running(setup.folder) as server:
        for large in large_requests():
            answer = server.post(large, 120.0, Prefer="wait=60")
            layout: Any = answer.body
            slowest = max(slowest, seconds_of(layout))
            result = layout.get("result") or {}
            word = result.get("outcome") or f"{layout.get('status')} {layout.get('error') or ''}"
            words[word] = words.get(word, 0) + 1
            failed += layout.get("status") != "succeeded"
    told = ", ".join(f"{count} {word}" for word, count in sorted(words.items()))
    return Finding(not failed and slowest < 7.0, f"{told}; slowest {slowest:.1f} s")


def seconds_of(layout: dict[str, Any]) -> float:
    """From the start of a solve to its end."""
    from datetime import datetime

    if not layout.get("finished_at"):
        return float("inf")
    ended, began = (datetime.fromisoformat(layout[name]) for name in ("finished_at", "started_at"))
    return (ended - began).total_seconds()


def large_requests() -> list[dict[str, Any]]:
    """Many arms, many poses, many obstacles, a proof that takes as long as it may, findings that cost time."""
    found = []
    draws = random.Random(5)
    for arms, poses, obstacles, more in (
        (8, 600, 100, {}),
        (2, 5000, 0, {}),
        (2, 600, 200, {}),
        (8, 50, 0, {"alternatives": 3}),
        (1, 5000, 200, {}),
        (4, 300, 20, {"baselines": ["exterior-penalty"]}),
    ):
        made = request(poses, f"{arms} arms, {poses} poses, {obstacles} obstacles", arms=1, time_limit=5.0)
        first = made["arms"][0]
        made["arms"] = [first | {"name": f"arm {k}"} for k in range(arms)]
        if obstacles:
            made["obstacles"] = [
                {
                    "name": f"obstacle {k}",
                    "shape": {"type": "box", "size": [0.1, 0.1, 0.1]},
                    "pose": {
                        "position": [draws.uniform(-3, 3), draws.uniform(-3, 3), draws.uniform(0, 2)],
                        "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]},
                    },
                }
                for k in range(obstacles)
            ]
        found.append(made | more)
    return found
