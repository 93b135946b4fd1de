"""The timings that the project promises, against their targets. Wall-clock medians on this machine, as it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import median
from time import perf_counter, sleep

import numpy as np

from bench.comparison.tasks import MAIN_GRASP, free_height, thesis_arc, thesis_line, ur_beam
from bench.timings.evaluation import drag
from bench.timings.server import request_of, serving, without_proof
from duocell.models.base.pose import rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import line
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights
from duocell.optimizer.optimize import optimize
from duocell.optimizer.settings import CertificateSettings, Settings

REQUESTS = 25
"""Over HTTP."""
SETTLED = 5.0
"""s after which a server has loaded what it loads when nobody is looking."""


@dataclass(frozen=True, slots=True)
class Timing:
    """One line of the table.

    Attributes:
        what: is measured. measured, lowest: median and best of ``runs``. target: at most, in the same ``unit``.
        note: remark, e.g. that there was no answer.
    """

    what: str
    measured: float
    lowest: float
    runs: int
    target: float
    unit: str = "s"
    note: str = ""

    def row(self) -> str:
        """Markdown."""
        if not self.runs:
            return f"| {self.what} | – | – | {self.target:g} {self.unit} | {self.note} |"
        ok = "met" if self.measured <= self.target else f"missed by {self.measured / self.target:.2g} ×"
        values = f"{self.measured:.3g} {self.unit} | {self.lowest:.3g} {self.unit} | {self.target:g} {self.unit}"
        return f"| {self.what} | {values} | {ok}{'; ' + self.note if self.note else ''} |"


def plain(runs: int, report: Callable[[Timing], None]) -> list[Timing]:
    """Measure everything; ``report`` is told about each line."""
    timings: list[Timing] = []

    def note(timing: Timing) -> None:
        timings.append(timing)
        report(timing)

    note(_solve("line, both arms, warm", thesis_line(10), 0.10, 2 * runs))
    note(_solve("arc, both arms, warm", thesis_arc(), 0.10, 2 * runs))
    note(_solve("UR10e pair, 10 poses", ur_beam(), 0.20, 2 * runs))
    note(_solve("PUMA pair, 1,000 poses", thesis_line(1000), 2.0, max(2, runs // 2)))
    for model in ("iiwa14", "fanuc_crx10ia"):
        note(_solve(f"{model} pair, 10 poses", pair(model), 3.0, max(2, runs // 2)))
    for gap, target in ((5e-3, 0.5), (1e-4, 3.0)):
        note(_prove(f"certificate of the line, gap {gap:.2%}", thesis_line(10), gap, target, runs))
        note(_prove(f"certificate of the arc, gap {gap:.2%}", thesis_arc(), gap, target, runs))
    note(_prove("certificate of the line, z free, gap 1.00%", free_height(thesis_line(10)), 1e-2, 10.0, 2))
    for timing in _http():
        note(timing)
    return timings


def table(timings: list[Timing]) -> str:
    """Markdown."""
    head = "| what | median | lowest | target | |\n|---|---|---|---|---|"
    return "\n".join([head, *(timing.row() for timing in timings)])


def _solve(what: str, cell: Cell, target: float, runs: int) -> Timing:
    """Whole `optimize` without a proof, warm."""
    settings = Settings(certificate=None)
    layout = optimize(cell, settings)
    times = []
    for _ in range(runs):
        began = perf_counter()
        optimize(cell, settings)
        times.append(perf_counter() - began)
    note = "" if layout.usable and layout.search.ended else f"outcome {layout.outcome}"
    return Timing(what, median(times), min(times), runs, target, note=note)


def _prove(what: str, cell: Cell, gap: float, target: float, runs: int) -> Timing:
    """The certificate's own time, all arms together."""
    times, note = [], ""
    for _ in range(runs):
        layout = optimize(cell, Settings(certificate=CertificateSettings(gap, 4.0 * target)))
        certificate = layout.certificate
        if certificate is None:
            return Timing(what, np.inf, np.inf, 0, target, note="no certificate in this version")
        times.append(certificate.wall_time)
        if not certificate.proved:
            note = "not proved" if certificate.gap is None else f"stopped at a gap of {certificate.gap:.3%}"
    return Timing(what, median(times), min(times), runs, target, note=note)


def _http() -> list[Timing]:
    """Round trips, memory and start of the server."""
    overheads, starts = [], []
    body = without_proof(request_of(thesis_line(10)))
    for _ in range(2):
        with serving() as server:
            starts.append(server.ready_after)
    with serving() as server:
        starts.append(server.ready_after)
        server.solve(body)
        sleep(SETTLED)
        for _ in range(REQUESTS):
            seconds, resource = server.solve(body)
            overheads.append(1e3 * (seconds - resource["result"]["search"]["wall_time"]))
        drags = [1e3 * seconds for seconds in drag(server)]
        server.solve(request_of(ur_beam()))
        server.solve(request_of(thesis_line(1000)))
        memory = server.peak_memory() / 1e6
    return [
        Timing("HTTP with Prefer: wait, over the search", median(overheads), min(overheads), REQUESTS, 8.0, "ms"),
        Timing("a layout evaluated over HTTP", median(drags), min(drags), len(drags), 50.0, "ms", "2 UR10e, 16 poses"),
        Timing("peak memory of a worker", memory, memory, 1, 400.0, "MB", "after 1,000 poses"),
        Timing("cold start of the server to ready", median(starts), min(starts), len(starts), 3.0),
    ]


def pair(model: str) -> Cell:
    """Two arms of one model on either side of a line of 30 cm that turns by 30°."""
    task = line(
        transform(np.eye(3), np.array([-0.15, 0.0, 0.5])), transform(rotation_z(0.5), np.array([0.15, 0.1, 0.5])), 10
    )
    chosen = robot(model)
    side = Interval(-1.2, 1.2)
    arm = Arm(
        name="main",
        robot=chosen,
        tool=np.eye(4),
        grasp=MAIN_GRASP,
        base=BaseRegion(side, side, Interval(0.0, 0.0)),
        lower=chosen.lower,
        upper=chosen.upper,
        reference=chosen.reference,
        weights=range_weights(chosen.lower, chosen.upper),
    )
    mirrored = transform(rotation_z(np.pi), np.zeros(3)) @ MAIN_GRASP
    return Cell(task, (arm, replace(arm, name="follower", grasp=mirrored)))
