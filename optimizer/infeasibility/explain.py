"""Why a cell has no layout and what would help: from proofs where there are any, else from searches."""

from __future__ import annotations

from collections.abc import Callable

from duocell.models.cell.cell import Cell
from duocell.optimizer.budget import search_time
from duocell.optimizer.infeasibility.conflicts import searched_conflict, sure_conflict
from duocell.optimizer.infeasibility.effort import BOX, BOX_POSE, Effort
from duocell.optimizer.infeasibility.remedies import remedies
from duocell.optimizer.infeasibility.two_changes import two_changes
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.findings import Explanation
from duocell.optimizer.results.layout import Layout

LEAST_WORTH, TIMES = 8.0, 1.6
"""s of an idle machine that an explanation is worth, or so many times what the answer was if that is more."""
BLOCKS, SINGLE = 0.6, 0.65
"""Shares of what is left for what blocks; then for changes of one thing, the rest being for two together."""


def explain(
    cell: Cell,
    layout: Layout,
    seed: int,
    deadline: float,
    first: Callable[[Explanation], None] = lambda explanation: None,
) -> Explanation | tuple[ArmSolution, ...]:
    """What blocks a cell, and the smallest changes that were found to help.

    Args:
        cell: the cell. layout: the answer without a usable layout. seed: of the searches.
        deadline: `time.perf_counter` value, soft.
        first: told what blocks as soon as that is known, before it is tried what would help.

    Returns:
        The explanation; or a layout that passes every check, should one turn up, one point per arm.
    """
    effort = Effort(worth(cell, layout), deadline)
    conflict, found, possible = sure_conflict(cell, effort.share(BLOCKS))
    if conflict is None and found is None:
        conflict, found = searched_conflict(cell, layout, effort, seed)
    if found is not None:
        return found
    assert conflict is not None
    first(Explanation(conflict.selection.words(cell), conflict.irreducible, ()))
    behind: tuple[str, ...] = ()
    told = remedies(cell, conflict, effort.share(SINGLE), seed, possible)
    if conflict.finish is not None:
        conflict = conflict.finish(effort.share(1.0 if told else 1.0 - SINGLE))
    if not told and conflict.together:
        told = remedies(cell, conflict, effort.share(SINGLE), seed)
    if not told:
        both, next_one = two_changes(cell, conflict, effort, seed)
        told = () if both is None else (both,)
        behind = () if next_one is None else next_one.words(cell)
    return Explanation(conflict.selection.words(cell), conflict.irreducible, told, behind)


def worth(cell: Cell, layout: Layout) -> float:
    """How much an explanation may cost [s of an idle machine]: by what the answer has cost, counted alike."""
    boxes = 0 if layout.certificate is None else layout.certificate.boxes
    solved = search_time(cell) + boxes * (BOX + BOX_POSE * len(cell.task)) if boxes else 0.0
    return max(LEAST_WORTH, TIMES * solved)
