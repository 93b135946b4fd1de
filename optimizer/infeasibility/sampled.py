"""A first layout of a cell, among samples of all arms together, or refined from places that are near to one."""

from __future__ import annotations

from collections.abc import Sequence

from optimizer.coupled.candidates.followed import Followed
from optimizer.coupled.candidates.layouts import sample_layouts
from optimizer.coupled.candidates.starts import starts_of
from optimizer.coupled.scene import Scene
from optimizer.coupled.sqp.refine import refine
from optimizer.infeasibility.effort import Effort
from optimizer.infeasibility.searched.trial import Found, clean
from optimizer.program import ArmPoint
from optimizer.reduced import ReducedProblem

DENSITIES = (0.15, 0.6)
"""Of the samples in which a first layout is looked for, see `optimizer.coupled.search.DENSITIES`."""
STARTS = 3, 2
"""Starts of each density that keep everything at the poses, and others."""


def first_layout(scene: Scene, starts: Sequence[Sequence[ArmPoint]], effort: Effort) -> Found | None:
    """The layout that the first start leads to which leads to one that passes every check."""
    for start in starts:
        if clean(scene, start):
            return Found(tuple(start), scene.objective(start))
        if not scene.cell.coupled or effort.over:
            continue
        refined = refine(scene, start, effort.deadline)
        effort.refined(scene.cell)
        if refined.clean:
            return Found(refined.points, refined.objective)
    return None


def sampled_layout(scene: Scene, problems: Sequence[ReducedProblem], effort: Effort, seed: int) -> Found | None:
    """A layout among samples of all arms together, as they are or refined."""
    followed = Followed.of(scene, problems)
    for round_, density in enumerate(DENSITIES):
        if effort.over:
            return None
        layouts, _ = sample_layouts(followed, density, seed + round_)
        effort.sampled(scene.cell, density)
        starts = starts_of(followed, layouts, *STARTS)
        kept = (start for start in starts if start.clean and clean(scene, start.points))
        first = next(kept, None)
        if first is not None:
            return Found(first.points, first.objective)
        found = first_layout(scene, [start.points for start in starts], effort)
        if found is not None:
            return found
    return None
