"""One trial: is there a layout of a cell? A search that ends with the first one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.coupled.combinations.combine import combine
from duocell.optimizer.coupled.combinations.pool import pool_of, with_optimum
from duocell.optimizer.infeasibility.searched.obstructed import obstruction
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.sqp.refine import refine
from duocell.optimizer.verification.scene import LIMITS, Scene, alone_scene

ARM_TIME = 4.0
"""s that the search of one arm alone may take."""
STARTS = 5
"""Combinations refined."""


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """A layout that passed every check.

    Attributes:
        points: one per arm. objective: E.
    """

    points: tuple[ArmSolution, ...]
    objective: float


@dataclass(frozen=True, eq=False, slots=True)
class Trial:
    """How a search ended.

    Attributes:
        found: a layout, or None, which is no proof that there is none.
        cut_short: True if time ran out before one round of candidates was through.
    """

    found: Found | None
    cut_short: bool = False


def find(
    cell: Cell, deadline: float, hints: Sequence[tuple[ArmSolution, ...]] = (), seed: int = 0, starts: int = STARTS
) -> Trial:
    """Look for a layout; the first one will do.

    Args:
        cell: any cell, even one without arms.
        deadline: `time.perf_counter` value, soft.
        hints: layouts (one point per arm) that may do as they are, or nearly so.
        seed: of the candidates.
        starts: combinations refined.
    """
    if not cell.arms:
        return Trial(None if obstruction(cell) else Found((), 0.0))
    scene = Scene.of(cell)
    for hint in hints:
        if clean(scene, hint):
            return Trial(Found(tuple(hint), scene.objective(hint)))
    if obstruction(cell):
        return Trial(None)
    alone = [_alone(cell, arm, deadline, seed) for arm in cell.arms]
    if any(search.best is None for search in alone):
        return Trial(None, not all(search.finished for search in alone))
    optimum = tuple(search.best for search in alone if search.best is not None)
    if clean(scene, optimum):
        return Trial(Found(optimum, scene.objective(optimum)))
    for start in (*hints, *_combinations(scene, alone, seed, deadline)[:starts]):
        refined = refine(scene, start, deadline)
        if refined.clean:
            return Trial(Found(refined.points, refined.objective))
        if time.perf_counter() > deadline:
            break
    return Trial(None, time.perf_counter() > deadline)


def clean(scene: Scene, points: Sequence[ArmSolution]) -> bool:
    """True if a layout passes every check as it is."""
    if max(scene.tie_violation(points), scene.floor_violation(points)) > LIMITS or not scene.usable(points):
        return False
    path = scene.certify(points)
    return path.clear and path.limit_excess <= LIMITS


def _alone(cell: Cell, arm: Arm, deadline: float, seed: int) -> ArmSearch:
    """The search of an arm that does not know of anything around it."""
    return search_arm(cell, arm, Settings(seed=seed), min(deadline, time.perf_counter() + ARM_TIME))


def _combinations(
    scene: Scene, alone: Sequence[ArmSearch], seed: int, deadline: float
) -> list[tuple[ArmSolution, ...]]:
    """Combinations of the arms' candidates, best first."""
    pools = []
    for index, search in enumerate(alone):
        pool = pool_of(scene, index, search.problem, 0, seed, deadline)
        if search.best is not None:
            pool = with_optimum(pool, alone_scene(scene.cell, search.arm), search.best, search.objective)
        pools.append(pool)
    combinations = combine(scene, pools, [search.problem for search in alone], 1, deadline)
    return [combination.points for combination in combinations]
