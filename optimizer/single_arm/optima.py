"""What a search of one arm keeps of the optima that it meets."""

from __future__ import annotations

from duocell.models.cell.cell import Cell
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.basins import distinct_optima
from duocell.optimizer.single_arm.local import worse_for_its_ends
from duocell.optimizer.single_arm.passable import best_passable


def keep_best(cell: Cell, search: ArmSearch, optima: list[tuple[float, ArmSolution]], deadline: float) -> None:
    """Take over the best of the optima whose way can be gone, and what they say about the basins."""
    fresh = sorted(optima, key=lambda optimum: optimum[0])
    search.optima = sorted(search.optima + optima, key=lambda optimum: optimum[0])
    search.basins = distinct_optima(search.optima)
    best = best_passable(cell, search.arm, fresh, search.objective, deadline)
    if best is None:
        return
    if search.best is None or best[0] < search.objective * worse_for_its_ends(cell, search.arm, search.best, best[1]):
        search.objective, search.best = best
