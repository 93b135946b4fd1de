"""The search of a coupled cell: uncoupled optima first, then combinations of candidates, refined until clean."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from models.cell import Cell
from models.posture import ALL_SIGNS
from optimizer.coupled.combine import Combination, combine
from optimizer.coupled.crowds import crowded
from optimizer.coupled.dead_ends import DeadEnds
from optimizer.coupled.obstructed import obstruction
from optimizer.coupled.pool import Pool, alone_scene, pool_of, with_optimum
from optimizer.coupled.refine import Refined, nearby, price_of, refine
from optimizer.coupled.scene import LIMITS, Scene
from optimizer.events import Started
from optimizer.layout import Reason
from optimizer.program import ArmPoint
from optimizer.progress.incumbents import layout_found
from optimizer.reduced import ReducedProblem
from optimizer.search import ArmSearch
from optimizer.settings import Settings
from optimizer.solve import SolveStatus
from optimizer.watch import tell

ROUNDS = 2
STARTS, IDLE = 8, 4
"""Refinements of a round; and how many in a row may lead to nothing better than a clean layout that is known, where no
alternatives are asked for. Of 36 random cells none got better after the second start that ended clean."""
WORTH = 1.25
"""Starts whose score is this much above the best clean layout are not worth a refinement."""
BESIDE = 0.06
"""m; a start this near to a better layout in the same postures is not worth a refinement either."""
APART, ELSEWHERE = 0.3, 6
"""m; starts this near to what is known in the same postures are no alternatives; refinements per alternative, twice."""
SAME_PLACE, SAME_COST = 0.02, 1e-3
"""m and relative: layouts nearer than this are the same."""


@dataclass(eq=False, slots=True)
class CoupledSearch:
    """What was found for a coupled cell.

    Attributes:
        found: distinct clean layouts, best first. nearest: the least violating one that was found, if none is clean.
        candidates: bases × postures looked at. starts: refinements. hits: how often the best layout was reached.
        finished: False if time ran out. reasons, proved: why there is none, and whether that is certain.
    """

    found: list[Refined] = field(default_factory=list)
    nearest: Refined | None = None
    candidates: int = 0
    starts: int = 0
    hits: int = 0
    finished: bool = True
    reasons: tuple[Reason, ...] = ()
    proved: bool = False

    @property
    def best(self) -> Refined | None:
        """The answer."""
        return self.found[0] if self.found else None


def search_coupled(
    cell: Cell,
    searches: Sequence[ArmSearch],
    settings: Settings,
    deadline: float,
    report: Callable[[str, float], None] = lambda what, share: None,
) -> CoupledSearch:
    """Find the best layout of arms that something couples.

    Args:
        cell: the cell. searches: of its arms alone, all successful, in order.
        settings: seed and number of alternatives.
        deadline: `time.perf_counter` value, soft.
        report: told what is being done and the share of it that is done.
    """
    search = CoupledSearch()
    search.reasons = obstruction(cell)
    if search.reasons:
        search.proved = True
        return search
    scene = Scene.of(cell)
    optimum = [arm.best for arm in searches if arm.best is not None]
    if _keep(search, _as_it_is(scene, optimum)) and settings.alternatives == 0:
        return search
    ends, idle = DeadEnds(scene), IDLE if settings.alternatives == 0 else STARTS + 1
    for round_ in range(ROUNDS):
        report("combining candidates", round_ / ROUNDS)
        combinations = _combinations(scene, search, searches, settings, round_, deadline)
        first = [Combination(tuple(optimum), scene.objective(optimum), np.inf)] if round_ == 0 else []
        _refine_all(scene, search, [*first, *combinations], ends, idle, deadline, report)
        if search.found or not search.finished:
            break
    if search.found and len(search.found) <= settings.alternatives and all(arm.problem is not None for arm in searches):
        report("looking for alternatives", 1.0)
        _look_elsewhere(scene, search, searches, settings, deadline)
    return search


def _look_elsewhere(
    scene: Scene, search: CoupledSearch, searches: Sequence[ArmSearch], settings: Settings, deadline: float
) -> None:
    """Layouts in other places or postures than those that are known, whatever they cost, as many as are asked for."""
    problems = [arm.problem for arm in searches if arm.problem is not None]
    starts: list[Combination] = []
    for some in (problems, *_in_other_postures(problems, search.found[0].points)):
        found, looked = crowded(scene, some, settings.seed, deadline, APART)
        starts += found
        search.candidates += looked
    starts.sort(key=lambda start: start.score(price_of(scene.cell)))
    tried: list[Sequence[ArmPoint]] = [one.points for one in search.found]
    for start in starts:
        if len(search.found) > settings.alternatives or len(tried) > ELSEWHERE * settings.alternatives:
            return
        if time.perf_counter() > deadline:
            search.finished = False
            return
        if any(nearby(start.points, points, APART) for points in tried):
            continue
        search.starts += 1
        refined = refine(scene, start.points, deadline, ())
        tried += [start.points, refined.points]
        if refined.clean:
            _keep(search, refined)


def _in_other_postures(
    problems: Sequence[ReducedProblem], points: Sequence[ArmPoint]
) -> Iterator[list[ReducedProblem]]:
    """The problems with one of the arms in any posture but that of its point."""
    for index, (problem, point) in enumerate(zip(problems, points, strict=True)):
        postures = problem.postures & np.array([signs != point.signs for signs in ALL_SIGNS])
        if np.any(postures):
            yield [*problems[:index], replace(problem, postures=postures), *problems[index + 1 :]]


def _as_it_is(scene: Scene, points: Sequence[ArmPoint]) -> Refined:
    """The arms' own optima, checked together."""
    clearance = scene.certify(points)
    lack = max(scene.tie_lack(points), scene.floor_lack(points))
    clean = lack <= LIMITS and clearance.clear and clearance.limit_excess <= LIMITS
    return Refined(tuple(points), scene.objective(points), lack, clean, clearance, 0)


def _combinations(
    scene: Scene,
    search: CoupledSearch,
    searches: Sequence[ArmSearch],
    settings: Settings,
    round_: int,
    deadline: float,
) -> list[Combination]:
    """Candidates of every arm, combined: few that were looked at closely, or many that were sifted.

    Without couplings the few are better; couplings leave none of them where they are, so there the many come first.
    """
    problems = [arm.problem for arm in searches if arm.problem is not None]
    if round_ == (0 if scene.cell.couplings else 1) and len(problems) == len(searches):
        found, looked = crowded(scene, problems, settings.seed + round_, deadline)
        search.candidates += looked
        return found
    pools: list[Pool] = []
    round_ = 0 if len(problems) == len(searches) else round_
    for index, arm in enumerate(searches):
        pool: Pool = pool_of(scene, index, arm.problem, round_, settings.seed, deadline)
        if arm.best is not None:
            pool = with_optimum(pool, alone_scene(scene.cell, arm.arm), arm.best, arm.objective)
        pools.append(pool)
        search.candidates += pool.evaluated
    return combine(scene, pools, [arm.problem for arm in searches], 2**round_, deadline)


def _refine_all(
    scene: Scene,
    search: CoupledSearch,
    starts: Sequence[Combination],
    ends: DeadEnds,
    idle: int,
    deadline: float,
    report: Callable[[str, float], None],
) -> None:
    """Refine what can lead to something better than what is known, until ``idle`` starts in a row did not."""
    price, in_vain = price_of(scene.cell), 0
    for number, start in enumerate(starts[: STARTS + 1]):
        if time.perf_counter() > deadline:
            search.finished = False
            return
        if in_vain >= idle:
            return
        if not _promising(search, start, price) or (start.lack > LIMITS and ends.leads_to_one(start.points)):
            continue
        report("refining", number / STARTS)
        search.starts += 1
        refined = refine(scene, start.points, deadline, search.found)
        ends.learn(start.points, refined)
        status = SolveStatus.OPTIMAL if refined.clean else SolveStatus.INFEASIBLE
        objective = refined.objective if refined.clean else None
        tell(Started("", search.starts, status.value, objective, refined.rounds))
        known = search.best
        _keep(search, refined)
        better = known is None or (
            search.best is refined and not refined.objective > (1.0 - SAME_COST) * known.objective
        )
        in_vain = 0 if better else in_vain + 1


def _promising(search: CoupledSearch, start: Combination, price: float) -> bool:
    """False for clean starts that are far worse than the best layout, or next to a layout that they do not better."""
    if search.best is None or start.lack > LIMITS:
        return True
    known = any(nearby(start.points, one.points, BESIDE) and start.objective > one.objective for one in search.found)
    return not known and start.score(price) <= WORTH * search.best.objective


def _keep(search: CoupledSearch, refined: Refined) -> bool:
    """Take a layout over; True if it is clean."""
    if not refined.clean:
        if search.nearest is None or refined.lack < search.nearest.lack:
            search.nearest = refined
        return False
    layout_found(refined.points, refined.objective)
    for other in search.found:
        if _same(refined, other):
            search.hits += other is search.found[0]
            return True
    search.found.append(refined)
    search.found.sort(key=lambda one: one.objective)
    if search.found[0] is refined:
        search.hits = 1
    return True


def _same(one: Refined, other: Refined) -> bool:
    if abs(one.objective - other.objective) > SAME_COST * max(one.objective, 1e-9):
        return False
    return nearby(one.points, other.points, SAME_PLACE)
