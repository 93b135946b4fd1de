"""Why a cell has no layout and what would help: from proofs where there are any, else from searches (`why_not`)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from models.cell import Cell
from models.surroundings import PairClass
from optimizer.findings import Explanation
from optimizer.infeasibility.arm_conflict import arm_conflict
from optimizer.infeasibility.cause import Infeasibility
from optimizer.infeasibility.immediate import immediate_infeasibility
from optimizer.infeasibility.pair_conflict import PairConflict, pair_conflict
from optimizer.infeasibility.remedies import combined_remedy, remedies
from optimizer.layout import Layout
from optimizer.program import ArmPoint
from optimizer.why_not.elements import Element, Kind, Selection
from optimizer.why_not.explain import explain as explain_by_search

LEAST_TIME, TIMES = 10.0, 2.0
"""s that an explanation may take, or so many times what the search took if that is more."""
SINGLE = 0.7
"""Of what is then left, for changes of one thing; where none helps, the rest is for two together."""
SHARE = 0.5
"""Of that time for what blocks; the rest is for what helps."""


def explain(cell: Cell, layout: Layout, seed: int, deadline: float) -> Explanation | tuple[ArmPoint, ...]:
    """What blocks a cell, and the smallest changes that were found to help.

    Args:
        cell: the cell. layout: the answer without a usable layout. seed: of the searches.
        deadline: `time.perf_counter` value, soft.

    Returns:
        The explanation; or a layout that passes every check, should one turn up, one point per arm.
    """
    started = time.perf_counter()
    end = min(deadline, started + max(LEAST_TIME, TIMES * layout.search.wall_time))
    causes = immediate_infeasibility(cell)
    if causes:
        conflict, irreducible = _selection(cell, causes[0]), _all_needed(causes[0])
    else:
        half = started + SHARE * (end - started)
        proved = arm_conflict(cell, half) or pair_conflict(cell, half)
        if isinstance(proved, PairConflict) and proved.layout is not None:
            return proved.layout
        if proved is None:
            found = explain_by_search(cell, layout, seed, deadline)
            # That the set leaves no layout was searched, not proved: what is not named may block as well.
            return replace(found, irreducible=False) if isinstance(found, Explanation) else found
        conflict, irreducible = proved.selection, proved.irreducible
    told = remedies(cell, conflict, time.perf_counter() + SINGLE * (end - time.perf_counter()), seed, _possible(causes))
    if not told:
        both = combined_remedy(cell, conflict, end, seed)
        told = () if both is None else (both,)
    return Explanation(conflict.words(cell), irreducible, told)


def _possible(causes: Sequence[Infeasibility]) -> dict[str, float]:
    """What could be kept of what is asked for, by the pointer to it, as far as that is proved."""
    found: dict[str, float] = {}
    for cause in causes:
        if cause.possible is not None:
            found[cause.pointer] = min(cause.possible, found.get(cause.pointer, cause.possible))
    return found


def _selection(cell: Cell, cause: Infeasibility) -> Selection:
    """What a cause that was proved before any search consists of."""
    names = {obstacle.name: k for k, obstacle in enumerate(cell.surroundings.obstacles)}
    elements = {Element(Kind.ARM, arm) for arm in cause.arms}
    elements |= {Element(Kind.OBSTACLE, names[name]) for name in cause.bodies if name in names}
    if cause.pair_class is PairClass.PART_OBSTACLE:
        elements.add(Element(Kind.PART))
    if cause.pair_class is PairClass.SELF:
        elements.add(Element(Kind.SELF))
    if cause.kind == "floor":
        elements.add(Element(Kind.FLOOR))
    if cause.kind in ("out_of_reach", "floor") or cause.pair_class is PairClass.ARM_ARM:
        elements |= {Element(Kind.REGION, arm) for arm in cause.arms}
    elements |= {Element(Kind.COUPLING, k) for k in _couplings(cell, cause)}
    poses: Sequence[int] = cause.poses or range(len(cell.task))
    return Selection(frozenset(elements), min(poses), max(poses))


def _couplings(cell: Cell, cause: Infeasibility) -> list[int]:
    """Couplings that a cause may rest on: all that tie its arms."""
    if cause.kind != "coupling" and cause.pair_class is not PairClass.ARM_ARM:
        return []
    tied = set(cause.arms)
    return [k for k, coupling in enumerate(cell.couplings) if len(tied & set(coupling.arms)) > 1]


def _all_needed(cause: Infeasibility) -> bool:
    """True where nothing is left to collide as soon as either of two bodies is left out."""
    return cause.pair_class in (PairClass.PART_OBSTACLE, PairClass.ARM_OBSTACLE)
