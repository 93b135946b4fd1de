"""The search of a coupled cell: uncoupled optima first, then sampled layouts, those that are clean first, refined."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from models.cell import Cell
from models.posture import ALL_SIGNS
from optimizer.coupled.arms_alone import impossible_alone
from optimizer.coupled.candidates.followed import Followed
from optimizer.coupled.candidates.layouts import sample_layouts
from optimizer.coupled.candidates.polish import polished
from optimizer.coupled.candidates.short_task import LONG, ShortTask
from optimizer.coupled.candidates.starts import Start, starts_of
from optimizer.coupled.combinations.combine import combine
from optimizer.coupled.combinations.pool import alone_scene, pool_of, with_optimum
from optimizer.coupled.obstructed import obstruction
from optimizer.coupled.scene import LIMITS, Scene
from optimizer.coupled.sqp.refine import Refined, nearby, price_of, refine
from optimizer.events import Started
from optimizer.layout import Reason
from optimizer.program import ArmPoint
from optimizer.progress.incumbents import layout_found
from optimizer.reduced import ReducedProblem
from optimizer.search import ArmSearch
from optimizer.settings import Settings
from optimizer.solve import SolveStatus
from optimizer.watch import tell

DENSITIES = (0.15, 1.0, 4.0)
"""Samples of each round, relative to `candidates.layouts.POSITIONS`: the first is to find a usable layout early, the
last is for cells in which the second finds none, and takes only what can be followed between the poses."""
CLEAN, OTHERS = 10, 6
"""Starts of a round that keep everything at the poses, and others."""
TRIED = 6
"""Of the clean ones, so many are checked as they are for a first usable layout."""
ROUNDS = 2
"""Of arms without a reduced problem, whose candidates are few and looked at closely."""
SHORT = (40, 160)
"""Poses that stand for a long task, at first and where nothing is found with these."""
IDLE = 4
"""How many refinements in a row may lead to nothing better than a clean layout that is known, where no alternatives are
asked for."""
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
        whole: False for a task that stands for a longer one. finished: False if time ran out.
        reasons, proved: why there is none, and whether that is certain.
    """

    found: list[Refined] = field(default_factory=list)
    nearest: Refined | None = None
    candidates: int = 0
    starts: int = 0
    hits: int = 0
    whole: bool = True
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
    optimum = tuple(arm.best for arm in searches if arm.best is not None)
    if _keep(search, _as_it_is(scene, optimum)) and settings.alternatives == 0:
        return search
    problems = [arm.problem for arm in searches if arm.problem is not None]
    if len(problems) == len(searches):
        if len(cell.task) > LONG:
            _search_short(scene, search, problems, optimum, settings, deadline, report)
        if not search.found and search.finished:
            _search_reduced(scene, search, problems, optimum, settings, deadline, report)
    else:
        _search_general(scene, search, searches, settings, deadline, report)
    if search.found and len(search.found) <= settings.alternatives and len(problems) == len(searches):
        report("looking for alternatives", 1.0)
        _look_elsewhere(scene, search, problems, settings, deadline)
    return search


def _search_short(
    scene: Scene,
    search: CoupledSearch,
    problems: Sequence[ReducedProblem],
    optimum: tuple[ArmPoint, ...],
    settings: Settings,
    deadline: float,
    report: Callable[[str, float], None],
) -> None:
    """Search on some of the poses, and refine what is found there on all of them; on more poses if that fails."""
    for count in SHORT:
        if len(scene.cell.task) <= count or not search.finished:
            return
        short = ShortTask.of(scene, problems, count)
        inner = CoupledSearch(whole=False)
        _search_reduced(short.scene, inner, short.short_problems, short.at_poses(optimum), settings, deadline, report)
        if inner.found and len(inner.found) <= settings.alternatives:
            _look_elsewhere(short.scene, inner, short.short_problems, settings, deadline)
        search.candidates, search.starts = search.candidates + inner.candidates, search.starts + inner.starts
        search.finished = inner.finished
        known = inner.found or [one for one in (inner.nearest,) if one is not None]
        carried = [short.on_whole(one.points) for one in known]
        starts = sorted((one for one in carried if one is not None), key=lambda one: (not one.clean, one.objective))
        _first_usable(scene, search, starts)
        _refine_all(scene, search, starts, IDLE if settings.alternatives == 0 else len(starts), deadline, report)
        if search.found:
            return


def _search_reduced(
    scene: Scene,
    search: CoupledSearch,
    problems: Sequence[ReducedProblem],
    optimum: tuple[ArmPoint, ...],
    settings: Settings,
    deadline: float,
    report: Callable[[str, float], None],
) -> None:
    """Rounds of samples, ever denser: the first until something is usable, the second for what is best."""
    followed = Followed.of(scene, problems)
    for round_, density in enumerate(DENSITIES):
        report("sampling layouts", round_ / len(DENSITIES))
        closely = round_ == len(DENSITIES) - 1
        layouts, tried = sample_layouts(followed, density, settings.seed + round_, closely=closely)
        search.candidates += tried
        if round_ > 0 and not closely and scene.model is None and scene.cell.surroundings.floor is None:
            layouts = polished(followed, layouts)
        starts = starts_of(followed, layouts, CLEAN, OTHERS)
        if not search.found:
            _first_usable(scene, search, starts)
        if round_ == 0 and search.found:
            continue
        if round_ == 0:
            search.reasons = impossible_alone(scene, problems, deadline)
            if search.reasons:
                search.proved = True
                return
        if round_ <= 1:
            starts.append(Start(optimum, scene.objective(optimum), np.inf))
        _refine_all(scene, search, starts, IDLE if settings.alternatives == 0 else len(starts), deadline, report)
        if (search.found and round_ > 0) or not search.finished:
            return


def _search_general(
    scene: Scene,
    search: CoupledSearch,
    searches: Sequence[ArmSearch],
    settings: Settings,
    deadline: float,
    report: Callable[[str, float], None],
) -> None:
    """Rounds of combinations of few candidates per arm, looked at closely."""
    for round_ in range(ROUNDS):
        report("combining candidates", round_ / ROUNDS)
        pools = []
        for index, arm in enumerate(searches):
            pool = pool_of(scene, index, arm.problem, round_, settings.seed, deadline)
            if arm.best is not None:
                pool = with_optimum(pool, alone_scene(scene.cell, arm.arm), arm.best, arm.objective)
            pools.append(pool)
            search.candidates += pool.evaluated
        combined = combine(scene, pools, [arm.problem for arm in searches], 2**round_, deadline)
        starts = [Start(one.points, one.objective, one.lack) for one in combined[: CLEAN + OTHERS]]
        _first_usable(scene, search, starts)
        _refine_all(scene, search, starts, IDLE if settings.alternatives == 0 else len(starts), deadline, report)
        if search.found or not search.finished:
            return


def _first_usable(scene: Scene, search: CoupledSearch, starts: Sequence[Start]) -> None:
    """Take over the cheapest of some starts that passes every check as it is."""
    for start in [one for one in starts if one.clean][:TRIED]:
        if _keep(search, _as_it_is(scene, start.points)):
            return


def _look_elsewhere(
    scene: Scene,
    search: CoupledSearch,
    problems: Sequence[ReducedProblem],
    settings: Settings,
    deadline: float,
) -> None:
    """Layouts in other places or postures than those that are known, whatever they cost, as many as are asked for."""
    starts: list[Start] = []
    for some in (problems, *_in_other_postures(problems, search.found[0].points)):
        followed = Followed.of(scene, some)
        layouts, tried = sample_layouts(followed, 1.0, settings.seed, worth=np.inf)
        starts += starts_of(followed, layouts, ELSEWHERE * settings.alternatives, OTHERS, APART)
        search.candidates += tried
    starts.sort(key=lambda start: (not start.clean, start.score(price_of(scene.cell))))
    tried_points: list[Sequence[ArmPoint]] = [one.points for one in search.found]
    for start in starts:
        if len(search.found) > settings.alternatives or len(tried_points) > ELSEWHERE * settings.alternatives:
            return
        if time.perf_counter() > deadline:
            search.finished = False
            return
        if any(nearby(start.points, points, APART) for points in tried_points):
            continue
        search.starts += 1
        refined = refine(scene, start.points, deadline, ())
        tried_points += [start.points, refined.points]
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


def _refine_all(
    scene: Scene,
    search: CoupledSearch,
    starts: Sequence[Start],
    idle: int,
    deadline: float,
    report: Callable[[str, float], None],
) -> None:
    """Refine what can lead to something better than what is known, until ``idle`` starts in a row did not."""
    price, in_vain = price_of(scene.cell), 0
    ends: list[Refined] = []
    refined_ones: list[Refined] = []
    for number, start in enumerate(starts):
        if time.perf_counter() > deadline:
            search.finished = False
            return
        if in_vain >= idle:
            return
        if not _promising(refined_ones, search, start, price):
            continue
        report("refining", number / len(starts))
        search.starts += 1
        beat = search.best.objective if search.best is not None and idle < len(starts) else np.inf
        refined = refine(scene, start.points, deadline, ends, beat)
        ends.append(refined)
        status = SolveStatus.OPTIMAL if refined.clean else SolveStatus.INFEASIBLE
        objective = refined.objective if refined.clean else None
        tell(Started("", search.starts, status.value, objective, refined.rounds))
        known = search.best
        if not refined.clean and start.clean and (known is None or start.objective < known.objective):
            refined = _as_it_is(scene, start.points)  # what a descent loses is not lost
        _keep(search, refined)
        if refined.clean:
            refined_ones.append(refined)
        better = known is None or (
            search.best is refined and not refined.objective > (1.0 - SAME_COST) * known.objective
        )
        in_vain = 0 if better else in_vain + 1


def _promising(refined: Sequence[Refined], search: CoupledSearch, start: Start, price: float) -> bool:
    """False for starts that are far worse than the best layout, or next to a refined one that they do not better."""
    if search.best is None:
        return True
    known = any(nearby(start.points, one.points, BESIDE) and start.objective > one.objective for one in refined)
    if start.clean:
        return not known and start.objective <= WORTH * search.best.objective
    return not known and start.objective < search.best.objective


def _keep(search: CoupledSearch, refined: Refined) -> bool:
    """Take a layout over; True if it is clean."""
    if not refined.clean:
        if search.nearest is None or refined.lack < search.nearest.lack:
            search.nearest = refined
        return False
    if search.whole:
        layout_found(refined.points, refined.objective)
    for number, other in enumerate(search.found):
        if _same(refined, other):
            search.hits += number == 0
            if refined.objective < other.objective:
                search.found[number] = refined
                search.found.sort(key=lambda one: one.objective)
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
