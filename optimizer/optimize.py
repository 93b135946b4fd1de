"""The one entry: a cell goes in, the best layout comes out."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from duocell.models.cell.cell import Cell
from duocell.optimizer.advice import with_advice
from duocell.optimizer.baselines.penalty import run_baseline
from duocell.optimizer.budget import automatic
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.coupled.layout import coupled_layout
from duocell.optimizer.coupled.one_place import all_kept_apart, kept_apart
from duocell.optimizer.coupled.open_poses import search_with_chosen_parameters
from duocell.optimizer.coupled.prove import against, prove
from duocell.optimizer.coupled.search import search_coupled
from duocell.optimizer.infeasibility.immediate.cause import Infeasibility
from duocell.optimizer.infeasibility.immediate.immediate import immediate_infeasibility, refused
from duocell.optimizer.monitoring.events import Verified
from duocell.optimizer.monitoring.watch import OutOfTime, ending, tell
from duocell.optimizer.nlp.measure import placed, segment_shares
from duocell.optimizer.progress.incumbents import arm_found, best_found, recording
from duocell.optimizer.progress.interim import interim_layout, unknown_layout, why_ended, with_what_is_missing
from duocell.optimizer.progress.known import Solved
from duocell.optimizer.progress.timetable import Progress, Timetable, timetable
from duocell.optimizer.reasons.reasons import name_segments
from duocell.optimizer.results.layout import Certificate, Layout, Outcome, Reason, Search
from duocell.optimizer.results.placement import Placement
from duocell.optimizer.settings import CertificateSettings, Settings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.verify import check, summarise

IMMEDIATE = 0.4
"""Share of the time limit after which nothing more is proved before the search."""
PLACES = 3
"""Searches of arms that would stand in one place; the last one is told of all arms."""
LATE = 0.5
"""s beyond the limits after which searches and proofs that do not look at them are ended."""


def optimize(cell: Cell, settings: Settings | None = None, progress: Progress | None = None) -> Layout:
    """Find the base placements that keep every joint as close to its reference as possible along the whole task.

    Arms are searched one by one first; where nothing couples them they are independent problems, and the objective is
    the sum. Couplings, floor and clearances are then brought in by `duocell.optimizer.coupled`. A proof follows, which
    decides about the word of the answer.

    Args:
        cell: task and arms.
        settings: seed, limits, what else to compute.
        progress: told what is being done, and the share of the whole that is done.

    Returns:
        The layout, verified. An impossible task is a layout with outcome ``infeasible`` and reasons, not an error.

    Raises:
        Cancelled: whoever watches (`duocell.optimizer.monitoring.watch`) wants an end.
    """
    settings = settings or Settings()
    started = time.perf_counter()
    table = timetable(cell, settings, progress)
    with recording(cell, started) as incumbents:
        causes = immediate_infeasibility(cell, started + IMMEDIATE * settings.time_limit)
        if causes:
            layout = _with_others(cell, causes, settings, started)
        else:
            layout = _solved(cell, settings, started, table)
    first = incumbents.first_time if layout.usable else None
    layout = replace(layout, search=replace(layout.search, first_feasible_time=first))
    if layout.verification is not None:
        found = layout.verification
        tell(Verified(found.max_position_error, found.max_orientation_error, found.limits_respected))
    advised = settings.tolerance is not None if layout.usable else settings.explain
    if advised or settings.baselines:  # which may take long
        tell(Solved(layout))
    layout = with_advice(cell, layout, settings, table, started + _limits(settings))
    if advised and settings.baselines:
        tell(Solved(layout))
    if layout.usable and layout.search.first_feasible_time is None:  # it turned up only when it was explained
        seconds = time.perf_counter() - started
        layout = replace(layout, search=replace(layout.search, first_feasible_time=seconds))
    baselines = []
    for index, method in enumerate(settings.baselines):
        table.stage("baselines")(f"baseline {method}", index / len(settings.baselines))
        baselines.append(run_baseline(method, cell, settings))
    return replace(layout, baselines=tuple(baselines))


def _with_others(cell: Cell, causes: tuple[Infeasibility, ...], settings: Settings, started: float) -> Layout:
    """A refusal with the placements of the arms that it does not concern, where nothing ties them to the others."""
    layout = refused(cell, causes, time.perf_counter() - started)
    blamed = {arm for cause in causes for arm in cause.arms}
    free = [arm for index, arm in enumerate(cell.arms) if index not in blamed]
    if cell.coupled or not blamed or not free:
        return layout
    deadline = started + settings.time_limit
    try:
        with ending(deadline + LATE):
            searches = [search_arm(cell, arm, settings, deadline) for arm in free]
    except OutOfTime:
        return layout
    found = _layout(cell, searches, None, layout.search.wall_time)
    return replace(layout, placements=found.placements, verification=found.verification, segments=found.segments)


@dataclass(frozen=True, eq=False, slots=True)
class _Found:
    """What searches and proof have found, to be checked.

    ``cell`` is the one that was asked about, with couplings for arms that would stand in one place otherwise;
    ``coupled`` is None where nothing ties the arms.
    """

    cell: Cell
    searches: list[ArmSearch]
    coupled: CoupledSearch | None
    certificate: Certificate | None
    searched: float


def _solved(cell: Cell, settings: Settings, started: float, table: Timetable) -> Layout:
    """Searched, proved and checked; where that would not end in time, the best layout that is known by then."""
    try:
        with ending(started + _limits(settings) + LATE):
            found = _found(cell, settings, started, table)
    except OutOfTime:
        return _cut_short(cell, settings, started)
    table.stage("verify")("verifying", 0.0)
    layout = _layout(found.cell, found.searches, found.certificate, found.searched)
    if found.coupled is not None:
        layout = coupled_layout(found.cell, layout, found.coupled, settings.alternatives)
    if settings.certificate == "auto" and found.certificate is not None and not found.certificate.ended:
        layout = replace(layout, search=replace(layout.search, ended=False))
    return _with_what_stopped_it(layout, settings)


def _limits(settings: Settings) -> float:
    """s for search and proof."""
    own = settings.certificate.time_limit if isinstance(settings.certificate, CertificateSettings) else 0.0
    return settings.time_limit + own


def _cut_short(cell: Cell, settings: Settings, started: float) -> Layout:
    """The best layout that the search has told of, checked, or that none is known."""
    best = best_found(cell)
    why, seconds = why_ended(settings.time_limit, found=best is not None), time.perf_counter() - started
    if best is None:
        return with_what_is_missing(unknown_layout(seconds, why), replace(settings, explain=False))
    return with_what_is_missing(interim_layout(cell, best.points, best.time, seconds, why, best.path), settings)


def _found(cell: Cell, settings: Settings, started: float, table: Timetable) -> _Found:
    """Searched and proved."""
    deadline = started + settings.time_limit
    searches: list[ArmSearch] = []
    for index, arm in enumerate(cell.arms):
        table.stage("arms")(f"searching {arm.name}", index / len(cell.arms))
        searches.append(search_arm(cell, arm, settings, deadline))
        _tell_of(cell, searches[-1])
    coupled = _couple(cell, searches, settings, deadline, table)
    cell, coupled = _in_two_places(cell, searches, coupled, settings, deadline, table)
    searched = time.perf_counter() - started
    together = coupled or CoupledSearch()
    certificate = _certificate(cell, searches, together, settings, deadline, table)
    if coupled is None and together.found:  # the proof found a layout where the search had none to start from
        coupled = together
    for search in searches:  # the proof may have found something better
        _tell_of(cell, search)
    if coupled is None and time.perf_counter() < deadline:  # what an arm violated may have been found by the proof
        coupled = _couple(cell, searches, settings, deadline, table)
    cell, coupled = _in_two_places(cell, searches, coupled, settings, deadline, table)
    return _Found(cell, searches, coupled, certificate, searched)


def _tell_of(cell: Cell, search: ArmSearch) -> None:
    if search.best is not None:
        arm_found(cell, search.arm, search.best, search.objective)


def _couple(
    cell: Cell, searches: list[ArmSearch], settings: Settings, deadline: float, table: Timetable
) -> CoupledSearch | None:
    """The search over all arms together, where something asks for it and every arm can do its part alone."""
    wanted = cell.coupled or settings.alternatives > 0
    if not wanted or any(search.best is None for search in searches):
        return None
    if all(cell.freedom(arm).exact for arm in cell.arms):
        return search_coupled(cell, searches, settings, deadline, table.stage("together"))
    return search_with_chosen_parameters(cell, searches, settings, deadline, table.stage("together"))


def _in_two_places(
    cell: Cell,
    searches: list[ArmSearch],
    coupled: CoupledSearch | None,
    settings: Settings,
    deadline: float,
    table: Timetable,
) -> tuple[Cell, CoupledSearch | None]:
    """The same, searched once more where two arms would stand in one place, and told that they must not."""
    for round_ in range(PLACES):
        points = [search.best for search in searches if search.best is not None]
        if coupled is not None:
            points = [] if coupled.best is None else list(coupled.best.points)
        apart = cell if len(points) < len(searches) else kept_apart(cell, points)
        if apart is cell:
            break
        cell = apart if round_ < PLACES - 1 else all_kept_apart(apart)
        coupled = _couple(cell, searches, settings, deadline, table)
        if coupled is None:  # the proof alone knows a place of some arm: nothing is there to search from
            return cell, CoupledSearch()
    return cell, coupled


def _certificate(
    cell: Cell,
    searches: list[ArmSearch],
    coupled: CoupledSearch,
    settings: Settings,
    deadline: float,
    table: Timetable,
) -> Certificate | None:
    """The proof that is asked for, or the automatic one, which the deadline cuts."""
    wanted = settings.certificate
    if wanted is None:
        return None
    if wanted == "auto":
        found = bool(coupled.found) or (not cell.coupled and all(search.best is not None for search in searches))
        wanted = automatic(cell, max(deadline - time.perf_counter(), 0.0), found)
    return prove(cell, searches, coupled, wanted, table.stage("proof"))


def _layout(cell: Cell, searches: list[ArmSearch], certificate: Certificate | None, wall_time: float) -> Layout:
    """What the arms do without each other, which is the answer where nothing couples them."""
    placements: list[Placement] = []
    checks = []
    reasons: list[Reason] = []
    for search in searches:
        reasons.extend(search.reasons)
        shown = search.best or search.nearest
        if shown is not None:
            placements.append(placed(cell, search.arm, shown))
            checks.append(check(cell, search.arm, shown))
    if certificate is not None:
        reasons = [*certificate.reasons, *reasons]
    complete = all(search.best is not None for search in searches)
    usable = complete and not cell.coupled
    objective = sum(p.objective for p in placements) if usable else None
    certificate = None if certificate is None else against(certificate, objective)
    proved = certificate is not None and certificate.proved
    if not usable:
        proved = proved or any(search.proved and search.best is None for search in searches)
    return Layout(
        outcome=Outcome.of(usable=usable, proved=proved),
        objective=objective,
        placements=tuple(placements),
        reasons=name_segments(cell.task, tuple(reasons)),
        search=Search(
            candidates=sum(search.candidates for search in searches),
            starts=sum(search.starts for search in searches),
            basins=sum(len(search.basins) for search in searches),
            wall_time=wall_time,
            ended=all(search.finished for search in searches),
        ),
        verification=summarise(checks) if checks else None,
        certificate=certificate,
        segments=segment_shares(cell, placements if complete else ()),
    )


def _with_what_stopped_it(layout: Layout, settings: Settings) -> Layout:
    """An answer that is not known, with the reason why the search went no further."""
    cut = any(reason.kind == "limit_reached" for reason in layout.reasons)
    if layout.outcome is not Outcome.UNKNOWN or cut:
        return layout
    if layout.search.ended:
        detail = (
            f"the search ended after {layout.search.candidates} candidates and {layout.search.starts} starts without a "
            "usable layout, and it is not proved that there is none; give a certificate more time, or change the cell"
        )
        reason = Reason("", "not_found", (), detail)
    else:
        detail = (
            f"the time limit of {settings.time_limit:g} s ended the search without a usable layout; allow more time"
        )
        reason = Reason("", "limit_reached", (), detail)
    return replace(layout, reasons=(*layout.reasons, reason))
