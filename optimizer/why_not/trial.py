"""One trial: is there a layout of a cell? A search that ends with the first one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from models.arm import Arm
from models.cell import Cell
from optimizer.coupled.combine import combine
from optimizer.coupled.obstructed import obstruction
from optimizer.coupled.pool import alone_scene, pool_of, with_optimum
from optimizer.coupled.refine import refine
from optimizer.coupled.scene import LIMITS, Scene
from optimizer.program import ArmPoint
from optimizer.search import ArmSearch, search_arm
from optimizer.settings import Settings

ARM_TIME = 1.5
"""s that the search of one arm alone may take."""
STARTS = 8
"""Combinations refined in a round."""


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """A layout that passed every check.

    Attributes:
        points: one per arm. objective: E.
    """

    points: tuple[ArmPoint, ...]
    objective: float


def find(
    cell: Cell,
    deadline: float,
    hints: Sequence[tuple[ArmPoint, ...]] = (),
    effort: int = 1,
    seed: int = 0,
    starts: int = STARTS,
) -> Found | None:
    """The first layout that is found.

    Args:
        cell: any cell, even one without arms.
        deadline: `time.perf_counter` value, soft.
        hints: layouts (one point per arm) that may do as they are, or nearly so.
        effort: rounds of candidates; each looks at more of them than the one before.
        seed: of the candidates.
        starts: combinations refined per round.

    Returns:
        None is no proof: nothing was found within the effort and the time.
    """
    if not cell.arms:
        return None if obstruction(cell) else Found((), 0.0)
    scene = Scene.of(cell)
    for hint in hints:
        if clean(scene, hint):
            return Found(tuple(hint), scene.objective(hint))
    if obstruction(cell):
        return None
    alone = [_alone(cell, arm, deadline, seed) for arm in cell.arms]
    if any(search.best is None for search in alone):
        return None
    optimum = tuple(search.best for search in alone if search.best is not None)
    if clean(scene, optimum):
        return Found(optimum, scene.objective(optimum))
    for round_ in range(effort):
        for start in (*hints, *_combinations(scene, alone, round_, seed, deadline)[:starts]):
            if time.perf_counter() > deadline:
                return None
            refined = refine(scene, start, deadline)
            if refined.clean:
                return Found(refined.points, refined.objective)
    return None


def clean(scene: Scene, points: Sequence[ArmPoint]) -> bool:
    """True if a layout passes every check as it is."""
    if max(scene.tie_lack(points), scene.floor_lack(points)) > LIMITS or not scene.usable(points):
        return False
    path = scene.certify(points)
    return path is None or (path.clear and path.limit_excess <= LIMITS)


def _alone(cell: Cell, arm: Arm, deadline: float, seed: int) -> ArmSearch:
    """The search of an arm that does not know of anything around it."""
    return search_arm(cell, arm, Settings(seed=seed), min(deadline, time.perf_counter() + ARM_TIME))


def _combinations(
    scene: Scene, alone: Sequence[ArmSearch], round_: int, seed: int, deadline: float
) -> list[tuple[ArmPoint, ...]]:
    """Combinations of the arms' candidates, best first."""
    pools = []
    for index, search in enumerate(alone):
        pool = pool_of(scene, index, search.problem, round_, seed, deadline)
        if search.best is not None:
            pool = with_optimum(pool, alone_scene(scene.cell, search.arm), search.best, search.objective)
        pools.append(pool)
    combinations = combine(scene, pools, [search.problem for search in alone], 2**round_, deadline)
    return [combination.points for combination in combinations]
