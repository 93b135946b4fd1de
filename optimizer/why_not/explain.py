"""The explanation of a cell for which no layout was found."""

from __future__ import annotations

import time

from models.cell import Cell
from optimizer.findings import Explanation
from optimizer.layout import Layout
from optimizer.program import ArmPoint
from optimizer.why_not.conflict import ConflictSearch
from optimizer.why_not.extend import Way
from optimizer.why_not.relaxations import relaxations

SHARE = 0.6
"""Share of the time that may go into what blocks; the rest is for what helps."""


def explain(cell: Cell, layout: Layout, seed: int, deadline: float) -> Explanation | tuple[ArmPoint, ...]:
    """What blocks a cell and what would help.

    Args:
        cell: the cell.
        layout: the infeasible answer, with what the arms can do at best.
        seed: of the searches.
        deadline: `time.perf_counter` value, soft.

    Returns:
        The explanation; or a layout that passes every check, should one turn up, one point per arm.
    """
    now = time.perf_counter()
    suspects = {reason.arm for reason in layout.reasons}
    search = ConflictSearch(cell, now + SHARE * (deadline - now), seed, suspects)
    last = len(cell.task) - 1
    numbers = {arm.name: a for a, arm in enumerate(cell.arms)}
    if layout.placements:
        search.meet(
            {numbers[p.arm]: Way(ArmPoint(p.position, p.yaw, p.joints, None), 0, last, ()) for p in layout.placements}
        )
    conflict = search.run()
    if search.solved:
        return tuple(search.known[-1].ways[a].point for a in range(len(cell.arms)))
    helpful = relaxations(cell, conflict, deadline, seed)
    return Explanation(conflict.selection.words(cell), conflict.irreducible, helpful)
