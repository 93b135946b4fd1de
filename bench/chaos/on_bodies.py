"""Bodies that are dear to read: what the others notice of them, and what each costs."""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from bench.chaos import bodies as sent
from bench.chaos.server import Server, request, running
from bench.chaos.trial import Finding, Setup
from duocell.service.library.document_stores import View
from duocell.service.requests.reading import Reader, read_evaluation, read_layout
from duocell.service.settings import Limits

AT_ONCE, VOLLEYS = 31, 3
LOOK_EVERY = 0.01
"""s between looks at /healthz."""
WITHIN = 0.05
"""s, 99 % of them."""


def hostile(setup: Setup) -> Finding:
    """Volleys of bodies, sent by another process, for this one measures."""
    context = multiprocessing.get_context("fork")
    answers: Any = context.SimpleQueue()
    with running(setup.folder) as server:
        ends = time.monotonic() + 5.0
        idle = looks(server, lambda: time.monotonic() < ends)
        senders = context.Process(target=_volleys, args=(server, answers))
        senders.start()
        busy = looks(server, lambda: answers.empty())
        got: list[tuple[int, float, int]] = answers.get()
        senders.join()
        peak = peak_memory(server.pid)
        layout = server.finished(server.post(request(3)).headers.get("location", "/none"))
    statuses = {status for status, _, _ in got}
    slowest, longest = max(seconds for _, seconds, _ in got), max(size for _, _, size in got)
    kept = statuses <= {400, 413, 422, 429, 503} and busy < WITHIN and layout.get("status") == "succeeded"
    kept = kept and slowest < 60.0 and longest < 1_000_000
    return Finding(
        kept,
        f"{sorted(statuses)} within {slowest:.1f} s, answers of at most {longest / 1e3:.0f} kB, 99 % of /healthz "
        f"within {1e3 * busy:.0f} ms ({1e3 * idle:.0f} ms before), {peak / 1e6:.0f} MB",
    )


def looks(server: Server, going_on: Callable[[], bool]) -> float:
    """s within which 99 % of the looks at /healthz are answered."""
    found = []
    while going_on():
        found.append(server.get("/healthz", 60.0).seconds)
        time.sleep(LOOK_EVERY)
    return sorted(found)[int(0.99 * (len(found) - 1))]


def _volleys(server: Server, answers: Any) -> None:
    got: list[tuple[int, float, int]] = []
    kinds = list(sent.hostile().values())

    def send(body: bytes) -> None:
        answer = server.ask("POST", "/v1/layouts", body, 300.0)
        got.append((answer.status, answer.seconds, len(str(answer.body))))

    for _ in range(VOLLEYS):
        threads = [threading.Thread(target=send, args=(kinds[k % len(kinds)],)) for k in range(AT_ONCE)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    answers.put(got)


def bodies(setup: Setup) -> Finding:
    """Each body is read in a process of its own; so is a plain request of its size."""
    worst_time, worst_memory = (0.0, ""), (0.0, "")
    kinds = sent.dear()
    for name, body in kinds.items():
        seconds, memory = cost(read_layout, body)
        usual = sent.plain(len(body))
        reader = read_evaluation if b'"joints"' in usual else read_layout
        allowed = 0.2 + 2.0 * cost(reader, usual)[0]
        worst_time = max(worst_time, (seconds / allowed, f"{name}: {seconds:.2f} s of {allowed:.2f} s"))
        bound = 50e6 + 20.0 * len(body)
        worst_memory = max(worst_memory, (memory / bound, f"{name}: {memory / 1e6:.0f} MB of {bound / 1e6:.0f} MB"))
    kept = worst_time[0] <= 1.0 and worst_memory[0] <= 1.0
    return Finding(kept, f"the worst of {len(kinds)}: {worst_time[1]}; {worst_memory[1]}")


def cost(reader: Reader, body: bytes) -> tuple[float, float]:
    """s of processor time, and bytes of memory, that reading a body takes; a first one has been read before."""
    context = multiprocessing.get_context("fork")
    told: Any = context.SimpleQueue()
    process = context.Process(target=_read, args=(reader, body, told))
    process.start()
    found: tuple[float, float] = told.get()
    process.join()
    return found


def _read(reader: Reader, body: bytes, told: Any) -> None:
    for first in (sent.plain(1000), sent.plain(100_000)):
        reader(first, Limits(), View(Path("/nonexistent")))
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before, began = memory_of("self", "VmRSS"), time.process_time()
    reader(body, Limits(), View(Path("/nonexistent")))
    told.put((time.process_time() - began, memory_of("self", "VmHWM") - before))


def peak_memory(pid: int) -> int:
    """Bytes that a process had at most."""
    return memory_of(str(pid), "VmHWM")


def memory_of(pid: str, what: str) -> int:
    """Bytes, by /proc."""
    with suppress(OSError), open(f"/proc/{pid}/status") as file:
        return next(int(line.split()[1]) * 1024 for line in file if line.startswith(what))
    return 0
