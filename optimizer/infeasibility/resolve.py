"""Is there a layout of a changed cell? Proofs on the arms' trees first, then the nearest places to begin from."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from models.cell import Cell
from optimizer.coupled.candidates.followed import Followed
from optimizer.coupled.candidates.layouts import sample_layouts
from optimizer.coupled.candidates.starts import starts_of
from optimizer.coupled.scene import Scene
from optimizer.coupled.sqp.refine import refine
from optimizer.infeasibility.arm_conflict import arm_tree
from optimizer.infeasibility.immediate import immediate_infeasibility
from optimizer.program import ArmPoint
from optimizer.reduced import ReducedProblem, reduced_problem
from optimizer.why_not.trial import Found, clean, find

DENSITIES = (0.15, 0.6)
"""Of the samples in which a first layout is looked for, see `optimizer.coupled.search.DENSITIES`."""
STARTS = 5, 3
"""Starts of each density that keep everything at the poses, and others."""


@dataclass(frozen=True, eq=False, slots=True)
class Resolved:
    """What is known of a changed cell.

    Attributes:
        found: a layout that passes every check, or None. proved: True if there is none.
        nearest: layouts of the arms by themselves, which the other arms may stand in the way of; empty where unknown.
    """

    found: Found | None
    proved: bool = False
    nearest: tuple[ArmPoint, ...] = ()


def resolved(cell: Cell, hints: Sequence[tuple[ArmPoint, ...]], deadline: float, seed: int) -> Resolved:
    """Look for a layout of a cell; the first one will do.

    Args:
        cell: any cell with arms. hints: layouts that may do, or nearly so, the best first.
        deadline: `time.perf_counter` value, soft. seed: of the samples.
    """
    if immediate_infeasibility(cell):
        return Resolved(None, proved=True)
    scene = Scene.of(cell)
    for hint in hints:
        if clean(scene, hint):
            return Resolved(Found(tuple(hint), scene.objective(hint)))
    problems = [reduced_problem(cell, arm) for arm in cell.arms]
    known = [problem for problem in problems if problem is not None]
    if len(known) < len(problems):
        return Resolved(find(cell, deadline, hints, seed).found)
    alone: list[ArmPoint] = []
    for index in range(len(cell.arms)):
        tree = arm_tree(cell, index, deadline)
        if tree is not None and tree.empty:
            return Resolved(None, proved=True)
        if tree is not None and tree.alone is not None:
            alone.append(tree.alone.point)
    starts = [tuple(alone), *hints] if len(alone) == len(problems) else list(hints)
    found = next((one for start in starts if (one := _refined(scene, start, deadline)) is not None), None)
    if found is None:
        found = _sampled(scene, known, deadline, seed)
    return Resolved(found, nearest=tuple(alone) if len(alone) == len(problems) else ())


def _refined(scene: Scene, start: Sequence[ArmPoint], deadline: float) -> Found | None:
    """The layout that a start leads to, if it passes every check."""
    if clean(scene, start):
        return Found(tuple(start), scene.objective(start))
    if not scene.cell.coupled or time.perf_counter() > deadline:
        return None
    refined = refine(scene, start, deadline)
    return Found(refined.points, refined.objective) if refined.clean else None


def _sampled(scene: Scene, problems: Sequence[ReducedProblem], deadline: float, seed: int) -> Found | None:
    """A layout among samples of all arms together, as they are or refined."""
    followed = Followed.of(scene, problems)
    for round_, density in enumerate(DENSITIES):
        if time.perf_counter() > deadline:
            return None
        layouts, _ = sample_layouts(followed, density, seed + round_)
        starts = starts_of(followed, layouts, *STARTS)
        for start in starts:
            if start.clean and clean(scene, start.points):
                return Found(start.points, start.objective)
        for start in starts:
            found = _refined(scene, start.points, deadline)
            if found is not None:
                return found
    return None
