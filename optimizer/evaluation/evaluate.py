"""A given layout, scored and verified without optimising: for a user who drags a base, or checks what was built."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.optimizer.clearance.clearance import found_clearances
from duocell.optimizer.evaluation.standing import as_given, choices, intervals
from duocell.optimizer.evaluation.together import together
from duocell.optimizer.nlp.measure import placed, segment_shares
from duocell.optimizer.reasons.faults import coupling_faults, floor_faults, path_faults, place_faults
from duocell.optimizer.reasons.reasons import name_segments
from duocell.optimizer.results.layout import Layout, Outcome, Reason, Search
from duocell.optimizer.verification.verify import summarise

NOT_FOUND = Reason(
    "",
    "not_found",
    (),
    "no path that keeps all rules was found from these bases, and it is not proved that there is none; send joints to "
    "have them checked",
)


def evaluate_layout(cell: Cell, joints: Sequence[Floats | None] | None = None) -> Layout:
    """Score and verify a layout.

    Args:
        cell: every base value is fixed.
        joints: per arm (m, n) rad to be checked as they are, or None for the best path that it has: the cheapest
            combination of the arms' postures in which nothing is hit.

    Returns:
        A layout, ``feasible`` if it breaks no rule, ``infeasible`` with a reason for every rule that it breaks, and
        ``unknown`` with those that the nearest path breaks where it is not certain that there is no other. Arms that
        reach all poses have a placement, whatever else they break.

    Raises:
        ValueError: a base value is not fixed.
    """
    started = time.perf_counter()
    if any(not interval.fixed for arm in cell.arms for interval in intervals(arm)):
        raise ValueError("only a layout whose bases are fixed can be evaluated")
    given = joints or [None] * len(cell.arms)
    found = [
        choices(cell, arm) if path is None else as_given(cell, arm, path)
        for arm, path in zip(cell.arms, given, strict=True)
    ]
    chosen = together(cell, found)
    standing = chosen.standing
    places = [np.array([interval.low for interval in intervals(arm)]) for arm in cell.arms]
    of_bases = (*floor_faults(cell, places), *coupling_faults(cell, places), *place_faults(cell, places))
    reasons = (
        *(reason for one in standing for reason in one.reasons),
        *of_bases,
        *(() if chosen.path is None else path_faults(replace(cell, arms=chosen.followed), chosen.path)),
    )
    reasons = tuple(dict.fromkeys(reasons))  # what is wrong with an arm by itself may be met again on the way
    outcome = Outcome.FEASIBLE
    if reasons:  # bases, the part and arms by themselves decide, or all that the arms can do together
        given_path = any(reason.kind == "collision" and not reason.arm for reason in reasons)
        alone = any(choice.complete and choice.best.reasons for choice in found)
        exact = all(cell.freedom(arm).exact for arm in cell.arms)  # else other displacements may do
        by_paths = exact and (given_path or chosen.settled)
        outcome = Outcome.of(usable=False, proved=bool(of_bases) or by_paths or alone)
    if outcome is Outcome.UNKNOWN:
        reasons = (*reasons, NOT_FOUND)
    placements = tuple(placed(cell, one.arm, one.point) for one in standing if one.point is not None)
    checks = [one.check for one in standing if one.check is not None]
    complete = len(placements) == len(standing)
    return Layout(
        outcome=outcome,
        objective=sum(placement.objective for placement in placements) if complete else None,
        placements=placements,
        reasons=name_segments(cell.task, reasons),
        search=Search(sum(one.looked_at for one in standing), 0, 0, time.perf_counter() - started),
        verification=summarise(checks) if checks else None,
        clearances=() if chosen.path is None else found_clearances(chosen.path),
        segments=segment_shares(cell, placements),
    )
