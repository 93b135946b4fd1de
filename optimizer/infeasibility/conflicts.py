"""What leaves a cell without a layout: by what is proved at once, by proofs on trees, else by search."""

from __future__ import annotations

import time
from collections.abc import Sequence

from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.immediate.cause import Infeasibility
from duocell.optimizer.infeasibility.immediate.immediate import immediate_infeasibility
from duocell.optimizer.infeasibility.proved_conflict import Conflict, proved_conflict
from duocell.optimizer.infeasibility.requirements import Kind, Requirement, Selection
from duocell.optimizer.infeasibility.searched.conflict import ConflictSearch
from duocell.optimizer.infeasibility.searched.partial_path import PartialPath
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.layout import Layout

SEARCHED = 0.6
"""Share of what is left for a search where nothing is proved."""


def sure_conflict(
    cell: Cell, effort: Effort
) -> tuple[Conflict | None, tuple[ArmSolution, ...] | None, dict[str, float]]:
    """A conflict that is proved; else a layout of the cell, should one turn up; and what could be kept by pointers.

    Args:
        cell: the cell. effort: that may be spent.
    """
    causes = immediate_infeasibility(cell, effort.deadline)
    if causes:
        return Conflict(_selection(cell, causes[0]), _all_needed(causes[0])), None, _possible(causes)
    found = proved_conflict(cell, effort)
    return (found, None, {}) if found is None or isinstance(found, Conflict) else (None, found, {})


def searched_conflict(
    cell: Cell, layout: Layout, effort: Effort, seed: int
) -> tuple[Conflict | None, tuple[ArmSolution, ...] | None]:
    """A set for which no layout was found, though that is not proved: what is not named may block as well."""
    deadline = min(effort.deadline, time.perf_counter() + SEARCHED * max(effort.left, 0.0))
    search = ConflictSearch(cell, deadline, seed, {reason.arm for reason in layout.reasons})
    numbers = {arm.name: a for a, arm in enumerate(cell.arms)}
    if layout.placements:
        last = len(cell.task) - 1
        paths = {
            numbers[p.arm]: PartialPath(ArmSolution(p.position, p.yaw, p.joints, None), 0, last, ())
            for p in layout.placements
        }
        search.meet(paths)
    began = time.process_time()
    selection = search.run().selection
    effort.spend(time.process_time() - began)
    if search.solved:
        return None, tuple(search.known[-1].paths[a].point for a in range(len(cell.arms)))
    return Conflict(selection, irreducible=False, proved=False), None


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
    requirements = {Requirement(Kind.ARM, arm) for arm in cause.arms}
    requirements |= {Requirement(Kind.OBSTACLE, names[name]) for name in cause.bodies if name in names}
    if cause.pair_class is PairClass.PART_OBSTACLE:
        requirements.add(Requirement(Kind.PART))
    if cause.pair_class is PairClass.SELF:
        requirements.add(Requirement(Kind.SELF))
    if cause.kind == "floor":
        requirements.add(Requirement(Kind.FLOOR))
    if cause.kind in ("out_of_reach", "floor") or cause.pair_class is PairClass.ARM_ARM:
        requirements |= {Requirement(Kind.REGION, arm) for arm in cause.arms}
    requirements |= {Requirement(Kind.COUPLING, k) for k in _couplings(cell, cause)}
    poses: Sequence[int] = cause.poses or range(len(cell.task))
    return Selection(frozenset(requirements), min(poses), max(poses))


def _couplings(cell: Cell, cause: Infeasibility) -> list[int]:
    """Couplings that a cause may rest on: all that tie its arms."""
    if cause.kind != "coupling" and cause.pair_class is not PairClass.ARM_ARM:
        return []
    tied = set(cause.arms)
    return [k for k, coupling in enumerate(cell.couplings) if len(tied & set(coupling.arms)) > 1]


def _all_needed(cause: Infeasibility) -> bool:
    """True where nothing is left to collide as soon as either of two bodies is left out."""
    return cause.pair_class in (PairClass.PART_OBSTACLE, PairClass.ARM_OBSTACLE)
