"""The one entry: a cell goes in, the best layout comes out."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from models.cell import Cell
from optimizer.advice import with_advice
from optimizer.certificate.budget import automatic
from optimizer.coupled.layout import coupled_layout
from optimizer.coupled.search import CoupledSearch, search_coupled
from optimizer.events import Stage, Verified
from optimizer.layout import Certificate, Layout, Outcome, Placement, Reason, Search
from optimizer.measure import jobs_of, placed
from optimizer.penalty import run_baseline
from optimizer.prove import prove
from optimizer.reasons import name_jobs
from optimizer.search import ArmSearch, search_arm
from optimizer.settings import Settings
from optimizer.verify import check, summarise
from optimizer.watch import check_stop, tell

Progress = Callable[[str, float], None]
"""Called with what is being done and the fraction done so far."""


def optimize(cell: Cell, settings: Settings | None = None, progress: Progress | None = None) -> Layout:
    """Find the base placements that keep every joint as close to its reference as possible along the whole task.

    Arms are searched one by one first; where nothing couples them they are independent problems, and the objective is
    the sum. Couplings, floor and clearances are then brought in by `optimizer.coupled`.

    Args:
        cell: task and arms.
        settings: seed, limits, what else to compute.
        progress: told about every stage.

    Returns:
        The layout, verified. An impossible task is a layout with outcome ``infeasible`` and reasons, not an error.

    Raises:
        Cancelled: whoever watches (`optimizer.watch`) wants an end.
    """
    settings = settings or Settings()
    report = _reporter(progress)
    started = time.perf_counter()
    deadline = started + settings.time_limit
    searches: list[ArmSearch] = []
    for index, arm in enumerate(cell.arms):
        report(f"searching {arm.name}", index / len(cell.arms))
        searches.append(search_arm(cell, arm, settings, deadline))
    coupled = _couple(cell, searches, settings, deadline, report)
    searched = time.perf_counter() - started
    certificate = _certificate(cell, searches, settings, deadline, report)
    report("verifying", 1.0)
    layout = _layout(cell, searches, certificate, searched)
    if coupled is not None:
        layout = coupled_layout(cell, layout, coupled, settings.alternatives)
    if layout.verification is not None:
        found = layout.verification
        tell(Verified(found.max_position_error, found.max_orientation_error, found.limits_respected))
    layout = with_advice(cell, layout, settings, report)
    baselines = []
    for method in settings.baselines:
        report(f"baseline {method}", 1.0)
        baselines.append(run_baseline(method, cell, settings))
    return replace(layout, baselines=tuple(baselines))


def _couple(
    cell: Cell, searches: list[ArmSearch], settings: Settings, deadline: float, report: Progress
) -> CoupledSearch | None:
    """The search over all arms together, where something asks for it and every arm can do its part alone."""
    wanted = cell.coupled or settings.alternatives > 0
    if not wanted or any(search.best is None for search in searches):
        return None
    return search_coupled(cell, searches, settings, deadline, report)


def _certificate(
    cell: Cell, searches: list[ArmSearch], settings: Settings, deadline: float, report: Progress
) -> Certificate | None:
    """The proof that is asked for, or the automatic one, which the deadline cuts."""
    wanted = settings.certificate
    if wanted is None:
        return None
    if wanted == "auto":
        wanted = automatic(cell, max(deadline - time.perf_counter(), 0.0))
    return prove(cell, searches, wanted, report)


def _reporter(progress: Progress | None) -> Progress:
    """Tells of every stage, and asks whether to go on with it."""

    def report(what: str, fraction: float) -> None:
        check_stop()
        tell(Stage(what, fraction))
        if progress is not None:
            progress(what, fraction)

    return report


def _layout(cell: Cell, searches: list[ArmSearch], certificate: Certificate | None, wall_time: float) -> Layout:
    """Collect the arms' results."""
    placements: list[Placement] = []
    checks = []
    reasons: list[Reason] = []
    for search in searches:
        reasons.extend(name_jobs(cell.task, search.reasons))
        if search.best is not None:
            placements.append(placed(cell, search.arm, search.best))
            checks.append(check(cell, search.arm, search.best))
    complete = len(placements) == len(searches)
    finished = all(search.finished for search in searches)
    outcome = (Outcome.OPTIMAL if finished else Outcome.FEASIBLE) if complete else Outcome.INFEASIBLE
    return Layout(
        outcome=outcome,
        objective=sum(p.objective for p in placements) if complete else None,
        placements=tuple(placements),
        reasons=tuple(reasons),
        proved=any(search.proved for search in searches) or (certificate is not None and certificate.proved),
        search=Search(
            candidates=sum(search.candidates for search in searches),
            starts=sum(search.starts for search in searches),
            basins=sum(len(search.basins) for search in searches),
            wall_time=wall_time,
        ),
        verification=summarise(checks) if checks else None,
        certificate=certificate,
        jobs=jobs_of(cell, placements),
    )
