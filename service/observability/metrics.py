"""What is counted for Prometheus, and who tells it: one registry per process.

Whoever sees something happen calls a function here; gauges are read when they are asked for (`watch`).
"""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    GCCollector,
    Histogram,
    Info,
    PlatformCollector,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.core import CounterMetricFamily, Metric
from prometheus_client.exposition import CONTENT_TYPE_LATEST as MEDIA_TYPE
from prometheus_client.registry import Collector

from duocell.service.common.version import package_version

__all__ = [
    "MEDIA_TYPE",
    "REGISTRY",
    "exposition",
    "job_finished",
    "reported",
    "request",
    "watch",
    "watch_log",
    "worker_died",
]

REGISTRY = CollectorRegistry()
for _collector in (ProcessCollector, PlatformCollector, GCCollector):
    _collector(registry=REGISTRY)
Info("duocell_build", "Version of the program.", registry=REGISTRY).info({"version": package_version()})

METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
"""Clients choose the method freely; a label may not grow with what they think of."""

_REQUESTS = Histogram(
    "duocell_http_request_duration_seconds",
    "Requests by route template, method and status; 499: the client left before the answer.",
    ["route", "method", "status"],
    buckets=(0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0),
    registry=REGISTRY,
)
_SOLVES = Histogram(
    "duocell_solve_duration_seconds",
    "Solves by outcome: that of the result, or the code of the failure.",
    ["outcome"],
    buckets=(0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0),
    registry=REGISTRY,
)
_STARTS = Counter("duocell_solver_starts", "Local optimisations run.", registry=REGISTRY)
_ITERATIONS = Counter("duocell_solver_iterations", "Iterations of IPOPT.", registry=REGISTRY)
_DEATHS = Counter("duocell_worker_deaths", "Workers that ended; each was replaced.", ["cause"], registry=REGISTRY)
_GAUGES = {
    "queued": Gauge("duocell_jobs_queued", "Jobs that wait for a worker.", registry=REGISTRY),
    "running": Gauge("duocell_jobs_running", "Jobs being solved.", registry=REGISTRY),
    "workers": Gauge("duocell_workers_alive", "Worker processes that live.", registry=REGISTRY),
}


def request(route: str, method: str, status: int, seconds: float) -> None:
    """A request was answered.

    Args:
        route: its template, such as /v1/layouts/{layout_id}; "" if there is none.
        method: as sent.
        status: as answered.
        seconds: until the last byte of the answer was handed on.
    """
    _REQUESTS.labels(route or "none", method if method in METHODS else "other", str(status)).observe(seconds)


def job_finished(outcome: str, seconds: float) -> None:
    """A job that had begun came to an end.

    Args:
        outcome: of its result; without one the code of its failure, or cancelled.
        seconds: the solve took.
    """
    _SOLVES.labels(outcome).observe(seconds)


def reported(kind: str, data: str) -> None:
    """A solve told of something: the kind of an event and its data as JSON; ends of local solves are counted."""
    if kind == "start":
        _STARTS.inc()
        _ITERATIONS.inc(json.loads(data)["iterations"])


def worker_died(exit_code: int) -> None:
    """A worker process ended, by itself or by a signal (a negative exit code)."""
    cause = f"exit {exit_code}" if exit_code >= 0 else signal.Signals(-exit_code).name
    _DEATHS.labels(cause).inc()


def watch(**gauges: Callable[[], float]) -> None:
    """Where gauges are read from: ``queued``, ``running``, ``workers``; the last caller counts."""
    for name, read in gauges.items():
        _GAUGES[name].set_function(read)


class _DroppedLines(Collector):
    """Lines of the log that were never written; whoever writes them counts."""

    def __init__(self) -> None:
        self.read: Callable[[], int] = lambda: 0

    def collect(self) -> Iterator[Metric]:
        """See `Collector`."""
        yield CounterMetricFamily("duocell_log_lines_dropped", "Lines that nobody read the log for.", value=self.read())


_DROPPED_LINES = _DroppedLines()
REGISTRY.register(_DROPPED_LINES)


def watch_log(dropped: Callable[[], int]) -> None:
    """Where the number of lines is read from that the log has dropped; the last caller counts."""
    _DROPPED_LINES.read = dropped


def exposition() -> bytes:
    """Everything in the text format of Prometheus."""
    return generate_latest(REGISTRY)
