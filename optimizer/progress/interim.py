"""The answer of a solve that is ended before it has one of its own: the best layout that is known, checked."""

from __future__ import annotations

from collections.abc import Sequence

from models.cell import Cell
from optimizer.layout import Layout, Outcome, Reason, Search
from optimizer.measure import jobs_of, placed
from optimizer.program import ArmPoint
from optimizer.verify import check, summarise


def interim_layout(cell: Cell, points: Sequence[ArmPoint], found_after: float, wall_time: float, why: str) -> Layout:
    """A layout that the search has found usable, checked with numbers that did not produce it.

    Args:
        cell: the cell. points: of its arms, in order.
        found_after: s, when it was found. wall_time: s, how long the search went on. why: what ended it, a sentence.

    Returns:
        A feasible layout without certificate, clearances and findings; an unknown one where the check says no.
    """
    checks = [check(cell, arm, point) for arm, point in zip(cell.arms, points, strict=True)]
    if not all(one.usable for one in checks):
        return unknown_layout(wall_time, why)
    placements = tuple(placed(cell, arm, point) for arm, point in zip(cell.arms, points, strict=True))
    return Layout(
        outcome=Outcome.FEASIBLE,
        objective=sum(placement.objective for placement in placements),
        placements=placements,
        reasons=(Reason("", "limit_reached", (), why),),
        search=Search(0, 0, 0, wall_time, ended=False, first_feasible_time=found_after),
        verification=summarise(checks),
        jobs=jobs_of(cell, placements),
    )


def unknown_layout(wall_time: float, why: str) -> Layout:
    """The answer where nothing was found that could be checked."""
    reason = Reason("", "limit_reached", (), why)
    return Layout(Outcome.UNKNOWN, None, (), (reason,), Search(0, 0, 0, wall_time, ended=False), None)
