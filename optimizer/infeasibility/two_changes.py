"""The conflict behind the first: two changes that help together where neither does alone."""

from __future__ import annotations

from dataclasses import replace

from duocell.models.cell.cell import Cell
from duocell.optimizer.infeasibility.changes.candidates import candidates
from duocell.optimizer.infeasibility.changes.remedy import Remedy
from duocell.optimizer.infeasibility.conflicts import sure_conflict
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.proved_conflict import Conflict
from duocell.optimizer.infeasibility.remedies import Bracket, Helpful, smallest
from duocell.optimizer.infeasibility.requirements import Selection
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.findings import Relaxation

BEHIND, BOTH = 0.3, 0.5
"""Shares of what is left for what is behind a change, and for the smallest number of each of two changes."""
MOST = 3
"""Changes of the first conflict that are looked behind."""


def two_changes(
    cell: Cell, conflict: Conflict, effort: Effort, seed: int
) -> tuple[Relaxation | None, Selection | None]:
    """Two changes that help together, and what is behind the first conflict; None for what is not found.

    The first undoes the conflict as far as it can, the second what still leaves no layout then. The smallest number of
    the first is looked for with all of the second, then that of the second.

    Args:
        cell: the cell. conflict: what blocks it. effort: that may be spent. seed: of the searches.
    """
    behind: Selection | None = None
    for first in _far_first(cell, conflict)[:MOST]:
        opened = first.change(first.most)
        found, _, _ = sure_conflict(opened, effort.share(BEHIND))
        if found is None or found.selection.requirements == conflict.selection.requirements:
            continue
        behind = found.selection if behind is None else behind
        for second in candidates(opened, found.selection):
            if second.pointer == first.pointer or effort.over:
                continue
            told = _both(first, second, found.selection, effort, seed)
            if told is not None:
                return told, found.selection
    return None, behind


def _far_first(cell: Cell, conflict: Conflict) -> list[Remedy]:
    """Changes of the conflict, those of what is known to be needed first, clearances last."""
    some = list(candidates(cell, conflict.selection))
    return sorted(some, key=lambda one: (one.undoes is None, one.undoes not in conflict.without))


def _both(first: Remedy, second: Remedy, behind: Selection, effort: Effort, seed: int) -> Relaxation | None:
    """The smallest numbers of two changes; None where they do not help together."""
    used = [first]  # the last one is what a layout made of it

    def after(cell: Cell) -> Remedy:
        """The second change, of a cell that the first has changed."""
        return next(one for one in candidates(cell, behind) if one.pointer == second.pointer)

    def composed(one: Remedy) -> Remedy:
        """The first change, where all of the second is made as well."""
        fit = one.fitted

        def fitted(points: tuple[ArmSolution, ...]) -> Remedy:
            used.append(one if fit is None else fit(points))
            return composed(used[-1])

        return replace(
            one,
            change=lambda amount: after(one.change(amount)).change(second.most),
            fitted=None if fit is None else fitted,
            kept=None,
        )

    one = smallest(composed(first), Bracket(0.0, first.most), (), effort.share(BOTH), seed)
    if not isinstance(one, Helpful):
        return None
    changed = used[-1].change(one.amount)
    then = after(changed)
    other = smallest(then, Bracket(0.0, then.most), [one.found.points], effort, seed)
    if not isinstance(other, Helpful):
        return None
    return Relaxation(f"{one.words}, and {other.words}", one.remedy.pointer, other.found.objective)
