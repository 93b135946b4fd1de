"""A first layout of a cell, among samples of all arms together, or refined from places that are near to one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.coupled.candidates.followed import Followed
from duocell.optimizer.coupled.candidates.layouts import sample_layouts
from duocell.optimizer.coupled.candidates.starts import starts_of
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.searched.trial import Found, clean
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.coupled import Pairing
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.sqp.refine import refine
from duocell.optimizer.verification.scene import LIMITS, Scene

DENSITIES = (0.15, 0.6)
"""Of the samples for a first layout, see `duocell.optimizer.parameters.coupled.CoupledParameters`."""
STARTS = 3, 2
"""Starts of each density that keep everything at the poses, and others."""
FEW = Pairing(48, (48, 144), 2048)
"""Fewer pairs than in a search for the best layout: where none goes together, all of them are looked at."""


def first_layout(scene: Scene, starts: Sequence[Sequence[ArmSolution]], effort: Effort) -> Found | None:
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
        layouts, _ = sample_layouts(followed, density, seed + round_, FEW)
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


def least_layouts(
    scene: Scene,
    problems: Sequence[ReducedProblem],
    need: Callable[[Sequence[Floats]], Floats] | None,
    density: float,
    seed: int,
) -> tuple[Found, ...]:
    """A few layouts among samples of all arms together that pass every check.

    Args:
        scene: of the changed cell. problems: of its arms.
        need: see `duocell.optimizer.infeasibility.changes.remedy.Remedy`; those that need least come first, else the
        cheapest.
        density: of the samples. seed: of the samples.
    """
    followed = Followed.of(scene, problems)
    layouts, _ = sample_layouts(followed, density, seed, FEW)
    if not len(layouts):
        return ()
    if need is not None:
        needed = need([own.joints[:, followed.poses] for own in layouts.placements])
        layouts = layouts.take(np.lexsort((needed, layouts.violations > LIMITS)))
    starts = (start for start in starts_of(followed, layouts, *STARTS) if start.clean)
    return tuple(Found(start.points, start.objective) for start in starts if clean(scene, start.points))
