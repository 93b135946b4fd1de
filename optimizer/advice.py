"""What goes beyond the answer: how exactly it has to be built, or what stands in the way of one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextvars import copy_context
from dataclasses import replace
from math import inf

from duocell.models.cell.cell import Cell
from duocell.models.cell.one_place import in_one_place
from duocell.optimizer.clearance.clearance import found_clearances
from duocell.optimizer.coupled.prove import against
from duocell.optimizer.infeasibility.explain import explain
from duocell.optimizer.monitoring.watch import OutOfTime, ending, tell, unheard
from duocell.optimizer.nlp.measure import placed, segment_shares
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.progress.interim import with_what_is_missing
from duocell.optimizer.progress.known import Solved
from duocell.optimizer.progress.timetable import Timetable
from duocell.optimizer.results.findings import Explanation
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import Settings
from duocell.optimizer.tolerance.tolerance import tolerance_of
from duocell.optimizer.verification.scene import Scene
from duocell.optimizer.verification.verify import check, summarise

LATE = 0.5
"""s beyond its limit after which an explanation that does not look at it is ended."""


def with_advice(cell: Cell, layout: Layout, settings: Settings, table: Timetable, end: float = inf) -> Layout:
    """The layout with what is asked for: why there is no usable one, or the tolerance of one that is usable.

    Args:
        cell: the cell. layout: its answer. settings: of the call. table: told what is being done.
        end: `time.perf_counter` value of the limits, beyond which a tolerance is not begun or is cut.
    """
    exact = all(cell.freedom(arm).exact for arm in cell.arms)
    if not layout.usable and settings.explain and exact:  # explanations speak of poses that are given
        table.stage("explain")("explaining", 0.0)
        found = _explained(cell, layout, settings)
        if isinstance(found, Layout):
            return found
        if in_one_place(cell.arms, [point.position for point in found]):  # nothing else is in the way
            return layout
        layout = _rescued(cell, layout, found)
    if layout.usable and settings.tolerance is not None:
        table.stage("tolerance")("displacing bases", 0.0)
        try:
            with ending(end + LATE):
                found_tolerance = tolerance_of(
                    cell, layout.placements, layout.clearances, settings.tolerance, settings.seed
                )
        except OutOfTime:
            return with_what_is_missing(layout, replace(settings, baselines=()))
        return replace(layout, tolerance=found_tolerance)
    return layout


def _explained(cell: Cell, layout: Layout, settings: Settings) -> Layout | tuple[ArmSolution, ...]:
    """The layout with its explanation, as much of it as the time allows for; or points of a layout that turned up."""
    outside, known = copy_context(), [layout]

    def first(explanation: Explanation) -> None:
        known[0] = replace(layout, explanation=explanation)
        outside.run(tell, Solved(known[0]))

    deadline = time.perf_counter() + settings.time_limit
    try:
        with unheard(), ending(deadline + LATE):  # the searches in there are not those of the answer
            found = explain(cell, layout, settings.seed, deadline, first)
    except OutOfTime:
        return with_what_is_missing(known[0], replace(settings, baselines=()))
    return replace(layout, explanation=found) if isinstance(found, Explanation) else found


def _rescued(cell: Cell, layout: Layout, points: Sequence[ArmSolution]) -> Layout:
    """The layout that turned up while it was being explained why there is none."""
    path = Scene.of(cell).certify(points)
    placements = tuple(placed(cell, arm, point) for arm, point in zip(cell.arms, points, strict=True))
    objective = sum(placement.objective for placement in placements)
    certificate = None if layout.certificate is None else against(layout.certificate, objective)
    return replace(
        layout,
        outcome=Outcome.of(usable=True, proved=certificate is not None and certificate.proved),
        objective=objective,
        placements=placements,
        reasons=(),
        verification=summarise([check(cell, arm, point) for arm, point in zip(cell.arms, points, strict=True)]),
        certificate=certificate,
        clearances=found_clearances(path),
        segments=segment_shares(cell, placements),
    )
