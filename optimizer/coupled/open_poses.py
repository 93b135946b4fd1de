"""Cells with something that couples the arms, whose poses leave something open.

The arms have been searched one by one. What they have chosen for their open parameters is then given, and the cell is
searched like any other: every layout of that is one of the cell that was asked about. So what is found is checked as
usual. From where the arms then stand the parameters are chosen anew, and the cell is searched again, while that helps.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm, BaseRegion, Interval
from duocell.optimizer.clearance.clearance import PathClearance
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.coupled.search import search_coupled
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.progress.incumbents import layout_found
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.sqp.refine import Refined

CHOICES, AGAIN = 3, 3
"""Choices of the parameters that are tried while none leads to a layout, and how often they are chosen anew."""
WORTH = 1e-3
"""Relative; what is better by less is not searched again for."""
NEAR = 0.1
"""m and rad; parameters that differ by less at every pose are one choice."""


def search_with_chosen_parameters(
    cell: Cell,
    searches: Sequence[ArmSearch],
    settings: Settings,
    deadline: float,
    report: Callable[[str, float], None],
) -> CoupledSearch:
    """As `search_coupled`, for a cell with arms whose poses leave something open; all searches were successful."""
    choices = [_choices(search) for search in searches]
    found = CoupledSearch()
    for number in range(min(CHOICES, max(len(own) for own in choices))):
        points = [own[min(number, len(own) - 1)] for own in choices]
        found = _search(cell, searches, points, settings, deadline, report)
        if found.found or not found.finished:
            break
    for _ in range(AGAIN):
        best = found.best
        anew = None if best is None else _chosen_anew(cell, best.points, settings, deadline)
        if best is None or anew is None:
            break
        other = _search(cell, searches, anew, settings, deadline, report)
        if other.best is None or other.best.objective > (1.0 - WORTH) * best.objective:
            break
        found = replace(other, candidates=found.candidates + other.candidates, starts=found.starts + other.starts)
    return found


def _chosen_anew(
    cell: Cell, points: Sequence[ArmSolution], settings: Settings, deadline: float
) -> list[ArmSolution] | None:
    """The arms where they stand, with parameters that serve them better there; None where there are none."""
    anew, better = [], False
    for arm, point in zip(cell.arms, points, strict=True):
        found = None if point.free is None or time.perf_counter() > deadline else _at_its_place(cell, arm, point)
        if found is not None:
            search = search_arm(*found, settings, deadline)
            value = objective_of(cell, arm, point.joints)
            if search.best is not None and search.objective < (1.0 - WORTH) * value:
                point, better = search.best, True
        anew.append(point)
    return anew if better else None


def _at_its_place(cell: Cell, arm: Arm, point: ArmSolution) -> tuple[Cell, Arm]:
    """The cell of an arm alone whose base may only stand where it does."""
    x, y, z, yaw = (Interval(value, value) for value in map(float, (*point.position, point.yaw)))
    still = replace(arm, base=BaseRegion(x, y, z, yaw))
    return replace(cell, arms=tuple(still if one is arm else one for one in cell.arms)), still


def _choices(search: ArmSearch) -> list[ArmSolution]:
    """Optima of an arm, best first, whose open parameters are told apart; its best alone where nothing is open."""
    if search.best is None:
        raise AssertionError("an arm that found nothing is to be combined with others")
    kept = [search.best]
    if search.best.free is not None:
        for _, point in search.optima:
            if all(_apart(point.free, other.free) > NEAR for other in kept):
                kept.append(point)
    return kept


def _apart(one: Floats | None, other: Floats | None) -> float:
    return 0.0 if one is None or other is None else float(np.max(np.abs(one - other)))


def _search(
    cell: Cell,
    searches: Sequence[ArmSearch],
    points: Sequence[ArmSolution],
    settings: Settings,
    deadline: float,
    report: Callable[[str, float], None],
) -> CoupledSearch:
    """The search with the parameters of some points."""
    values = [point.free for point in points]
    chosen = cell.with_parameters(values)
    stand_ins = [
        search if point.free is None else _stand_in(chosen, index, search, point)
        for index, (search, point) in enumerate(zip(searches, points, strict=True))
    ]

    def lifted(layout: Sequence[ArmSolution]) -> tuple[ArmSolution, ...]:
        return tuple(replace(point, free=own) for point, own in zip(layout, values, strict=True))

    def told(layout: Sequence[ArmSolution], objective: float, path: PathClearance | None) -> None:
        layout_found(lifted(layout), objective, path)

    def lift(refined: Refined) -> Refined:
        return replace(refined, points=lifted(refined.points))

    found = search_coupled(chosen, stand_ins, settings, deadline, report, told)
    found.found = [lift(one) for one in found.found]
    found.nearest = None if found.nearest is None else lift(found.nearest)
    found.proved = False  # of these parameters alone
    return found


def _stand_in(chosen: Cell, index: int, search: ArmSearch, point: ArmSolution) -> ArmSearch:
    """The search of an arm as if the parameters had been given."""
    arm = chosen.arms[index]
    return replace(search, arm=arm, best=replace(point, free=None), problem=reduced_problem(chosen, arm), tree=None)
