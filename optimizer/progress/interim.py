"""The answer of a solve that is ended before it has one of its own: the best layout that is known, checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from duocell.models.cell.cell import Cell
from duocell.optimizer.clearance.clearance import PathClearance, found_clearances
from duocell.optimizer.nlp.measure import placed, segment_shares
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.layout import Layout, Outcome, Reason, Search
from duocell.optimizer.settings import Settings
from duocell.optimizer.verification.scene import Scene
from duocell.optimizer.verification.verify import check, summarise

LIMIT_REACHED = "limit_reached"
"""Kind of the reason that says what the time did not suffice for."""
MORE = "allow more time"


def interim_layout(
    cell: Cell,
    points: Sequence[ArmSolution],
    found_after: float,
    wall_time: float,
    why: str,
    path: PathClearance | None = None,
) -> Layout:
    """A layout that the search has found usable, checked with numbers that did not produce it.

    Args:
        cell: the cell. points: of its arms, in order.
        found_after: s, when it was found. wall_time: s, how long the search went on. why: what ended it, a sentence.
        path: the check of its whole way, where that is at hand; else it is made here, if any clearance is asked for.

    Returns:
        A feasible layout without certificate and findings; an unknown one where a check says no.
    """
    checks = [check(cell, arm, point) for arm, point in zip(cell.arms, points, strict=True)]
    if not all(one.usable for one in checks):
        return unknown_layout(wall_time, why)
    if path is None and cell.surroundings.clearances.any:
        path = Scene.of(cell).certify(points)
        if not path.clear:
            return unknown_layout(wall_time, why)
    placements = tuple(placed(cell, arm, point) for arm, point in zip(cell.arms, points, strict=True))
    return Layout(
        outcome=Outcome.FEASIBLE,
        objective=sum(placement.objective for placement in placements),
        placements=placements,
        reasons=(Reason("", LIMIT_REACHED, (), why),),
        search=Search(0, 0, 0, wall_time, ended=False, first_feasible_time=found_after),
        verification=summarise(checks),
        clearances=() if path is None else found_clearances(path),
        segments=segment_shares(cell, placements),
    )


def unknown_layout(wall_time: float, why: str) -> Layout:
    """The answer where nothing was found that could be checked."""
    reason = Reason("", LIMIT_REACHED, (), why)
    return Layout(Outcome.UNKNOWN, None, (), (reason,), Search(0, 0, 0, wall_time, ended=False), None)


def why_ended(limit: float, *, found: bool) -> str:
    """What ended a solve, in a sentence.

    Args:
        limit: s, that were given. found: whether any layout is known that could be checked.
    """
    if found:
        return f"the time limit of {limit:g} s ended the solve; this is the best layout that was known, checked"
    return f"the time limit of {limit:g} s ended the solve before any layout was found that could be checked"


def with_what_is_missing(layout: Layout, settings: Settings | None) -> Layout:
    """An answer that names what was asked for and is null or empty in it, because there was no time.

    Args:
        layout: the answer. settings: what was asked for; None where that is not known yet.
    """
    missing = [] if settings is None else _missing(layout, settings)
    cut = next((number for number, reason in enumerate(layout.reasons) if reason.kind == LIMIT_REACHED), None)
    reasons = list(layout.reasons)
    if cut is not None:
        words = [reasons[cut].detail.removesuffix(f"; {MORE}").partition("; not computed")[0]]
        words += [f"not computed, and null or empty here: {', '.join(missing)}"] if missing else []
        reasons[cut] = replace(reasons[cut], detail="; ".join([*words, MORE]))
    elif missing:
        detail = (
            f"the time ended before these were computed, which are null, empty or not complete: {', '.join(missing)}"
        )
        reasons.append(Reason("", LIMIT_REACHED, (), f"{detail}; {MORE}"))
    return replace(layout, reasons=tuple(reasons))


def _missing(layout: Layout, settings: Settings) -> list[str]:
    """Fields of the result."""
    asked = {
        "certificate": settings.certificate is not None and layout.certificate is None,
        "alternatives": settings.alternatives > 0 and layout.usable and not layout.search.ended,
        "tolerance": settings.tolerance is not None and layout.usable and layout.tolerance is None,
        "explanation": settings.explain and not layout.usable,
        "baselines": len(layout.baselines) < len(settings.baselines),
    }
    return [name for name, missing in asked.items() if missing]
