"""What can be proved impossible before any search, in some tens of milliseconds."""

from __future__ import annotations

from math import inf

from duocell.models.cell.cell import Cell
from duocell.models.collision.collision import CollisionModel
from duocell.optimizer.infeasibility.immediate.base_regions import floor_conflicts, region_conflicts
from duocell.optimizer.infeasibility.immediate.cause import Infeasibility
from duocell.optimizer.infeasibility.immediate.coupling_conflicts import coupling_conflicts
from duocell.optimizer.infeasibility.immediate.fixed_bodies import fixed_body_conflicts
from duocell.optimizer.infeasibility.immediate.one_place import one_place_conflicts
from duocell.optimizer.infeasibility.immediate.relative_bases import relative_base_conflicts
from duocell.optimizer.infeasibility.immediate.self_distances import self_distance_conflicts
from duocell.optimizer.nlp.measure import segment_shares
from duocell.optimizer.reasons.reasons import name_segments
from duocell.optimizer.results.layout import Layout, Outcome, Search


def immediate_infeasibility(cell: Cell, deadline: float = inf) -> tuple[Infeasibility, ...]:
    """Causes each of which proves that a cell has no layout; empty where none is found, which proves nothing.

    Args:
        cell: any cell with arms. Singularities are not looked at, so the proofs hold whatever is said of them.
        deadline: `time.perf_counter` value after which no further bodies are looked at, soft.

    Raises:
        Cancelled: whoever watches (`duocell.optimizer.monitoring.watch`) wants an end.
    """
    found = [*coupling_conflicts(cell), *one_place_conflicts(cell)]
    if any(not cell.freedom(arm).exact for arm in cell.arms):
        return tuple(found)  # the others speak of poses that are given
    clearances = cell.surroundings.clearances
    model = CollisionModel(cell.arms, cell.surroundings) if clearances.any else None
    if model is not None:
        found += fixed_body_conflicts(cell, model, deadline)
        found += self_distance_conflicts(cell, model, deadline)
    found += region_conflicts(cell)
    found += floor_conflicts(cell)
    if not found:
        found += relative_base_conflicts(cell, model)
    return tuple(found)


def refused(cell: Cell, causes: tuple[Infeasibility, ...], wall_time: float) -> Layout:
    """The answer for a cell that was proved impossible before any search.

    Args:
        cell: the cell. causes: at least one. wall_time: s that the proof took.
    """
    return Layout(
        outcome=Outcome.INFEASIBLE,
        objective=None,
        placements=(),
        reasons=name_segments(cell.task, tuple(cause.reason(cell) for cause in causes)),
        search=Search(candidates=0, starts=0, basins=0, wall_time=wall_time),
        verification=None,
        segments=segment_shares(cell, ()),
    )
