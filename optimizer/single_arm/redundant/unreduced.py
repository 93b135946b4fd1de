"""Search of one arm that has no reduced problem: seven joints, no closed form, or a tilted first axis.

Stages of Gauss-Newton leave a few candidates, IPOPT polishes them (`duocell.optimizer.single_arm.redundant.stages`).
Two further nets are cast where joints have more than one turn, where the task is uneven, or where candidates had to
give way: paths recombined from all seeds' postures, and paths followed from random postures
(`duocell.optimizer.single_arm.continuation`).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import TURN, Arm
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.unreduced import PARAMETERS, UnreducedParameters
from duocell.optimizer.reduction.layers import LayeredPath, finish_path
from duocell.optimizer.single_arm.redundant.carriage import carried_form, spread_bases
from duocell.optimizer.single_arm.redundant.gauss_newton import Iterations, gauss_newton
from duocell.optimizer.single_arm.redundant.held_poses import with_held_poses
from duocell.optimizer.single_arm.redundant.ranking import best_windings, distinct, figures
from duocell.optimizer.single_arm.redundant.recombination import distinct_bases, over_carriage, recombined
from duocell.optimizer.single_arm.redundant.stages import (
    MOVED_ERROR,
    Staged,
    carried,
    likely,
    middle_problem,
    ranked,
    settled,
    staged,
    well_conditioned,
)
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, unreduced_problem
from duocell.optimizer.single_arm.redundant.varied_paths import INSIDE, follow, on_task
from duocell.optimizer.verification.verify import check

Optimum = tuple[float, ArmSolution]
Solver = Callable[[Cell, ArmSolution, float], list[Optimum]]
"""A local solve of a cell: the usable optimum reached from a start, or nothing; also nothing where it is sure to cost
more than the last argument."""
UNEVEN = 1.4
"""Times the mean weight of the poses looked at; steady tasks of one weight stay below."""
CHEAPER = 0.99
"""A candidate that costs less than this share of the best optimum has been changed much on its way there."""
SAME_OBJECTIVE = 1e-6
"""Relative; optima nearer than that are one."""
SAME_COST = 1e-4
"""Relative; candidates of arms with joints without end that cost the same and break nothing are one optimum in several
guises, for yaw and joints may turn against each other there at no cost."""
FOLLOWED_WORK = 4000
"""Poses of followed paths that are brought to their optimum, over all paths."""
ROUNDS = 3
"""Rounds with other seeds while nothing usable is found."""


@dataclass(eq=False, slots=True)
class UnreducedSearch:
    """What a search of an unreduced problem found.

    Attributes:
        optima: usable ones, in the order found. evaluated: seeds looked at. paths: the nearest ones, where there are no
            optima.
    """

    optima: list[Optimum] = field(default_factory=list)
    evaluated: int = 0
    paths: list[LayeredPath] = field(default_factory=list)

    @property
    def best(self) -> float:
        """Objective of the best optimum, infinite without one."""
        return min((objective for objective, _ in self.optima), default=np.inf)


def search_unreduced(
    cell: Cell,
    arm: Arm,
    box: Floats,
    seed: int,
    deadline: float,
    solve: Solver,
    parameters: UnreducedParameters = PARAMETERS,
    known: float = np.inf,
) -> UnreducedSearch:
    """Search the unreduced problem of one arm.

    Args:
        cell: task and step limit. arm: the arm. box: (3, 2) m from `duocell.optimizer.reduction.box.search_box`.
        seed: of the draws. deadline: `time.perf_counter` value, soft.
        solve: polishes a candidate, on the cell or on a smaller task of it. parameters: of the stages.
        known: objective; what costs more is of no use.
    """
    nets, held = _Nets(seed, deadline, solve, parameters, known), with_held_poses(cell, arm.dof)
    if held is None:
        return _rounds(cell, arm, box, nets)
    few = _rounds(held.cell, arm, box, nets)
    search = UnreducedSearch(evaluated=few.evaluated)
    before = np.inf
    for objective, point in sorted(few.optima, key=lambda optimum: optimum[0]):
        if nets.late or len(search.optima) >= parameters.polished:
            break
        if objective > before * (1.0 + SAME_OBJECTIVE) or not search.optima:
            search.optima += solve(cell, held.on_whole(point), known)
            before = objective
    enough = search.optima or nets.late or np.isfinite(known)
    return search if enough else _rounds(cell, arm, box, nets)


def _rounds(cell: Cell, arm: Arm, box: Floats, nets: _Nets) -> UnreducedSearch:
    """Rounds with other seeds until something usable is found; one where something is known already."""
    search = UnreducedSearch()
    problem = unreduced_problem(cell, arm, box)
    for round_ in range(ROUNDS):
        _round(cell, problem, search, replace(nets, seed=nets.seed + round_))
        if search.optima or nets.late or np.isfinite(nets.known):
            break
    return search


@dataclass(frozen=True, eq=False, slots=True)
class _Nets:
    """What a round is made with; see `search_unreduced`."""

    seed: int
    deadline: float
    solve: Solver
    parameters: UnreducedParameters
    known: float

    @property
    def late(self) -> bool:
        return time.perf_counter() > self.deadline


def _round(cell: Cell, problem: UnreducedProblem, search: UnreducedSearch, nets: _Nets) -> None:
    """Stages and, where they may have missed something, the two other nets."""
    search.evaluated += nets.parameters.seeds
    found = staged(problem, nets.parameters, nets.seed)
    if found is not None and not nets.late:
        _polish(cell, problem, search, found.seeds, nets)
        doubtful = many_turns(problem) or uneven(found.middle) or _cheaper(cell, problem, search, found.seeds)
        doubtful = doubtful or carried_form(problem) is not None
        if doubtful and not nets.late:
            _polish(cell, problem, search, _recombined(found, nets), nets)
    elif found is None and not nets.late:
        _polish(cell, problem, search, _over_region(problem, nets), nets)
    if (np.any(problem.endless) or not search.optima) and not nets.late:
        _follow(cell, problem, search, nets)
    if not search.optima and found is not None:
        search.paths += [
            finish_path(cell, problem.arm, point.position, point.yaw, point.joints.T.copy())
            for point in (problem.point(found.seeds.joints[:, :, k], base) for k, base in enumerate(found.seeds.bases))
        ]


def many_turns(problem: UnreducedProblem) -> bool:
    """True if some joint has more than a turn."""
    return bool(np.any((problem.upper - problem.lower > TURN) & (problem.turns > 0.0)))


def uneven(problem: UnreducedProblem) -> bool:
    """True if the task has several segments, or poses that count for much more or less than others."""
    return len(problem.starts) > 1 or float(np.max(problem.weights)) > UNEVEN * float(np.mean(problem.weights))


def _cheaper(cell: Cell, problem: UnreducedProblem, search: UnreducedSearch, seeds: Seeds) -> bool:
    """True if some candidate costs less than the best optimum: it breaks something, which other postures may not."""
    paths = (seeds.joints[:, :, k].T for k in range(len(seeds)))
    return any(objective_of(cell, problem.arm, path) < CHEAPER * search.best for path in paths)


def _polish(cell: Cell, problem: UnreducedProblem, search: UnreducedSearch, seeds: Seeds, nets: _Nets) -> None:
    """Solve from seeds, best first, while they can lead to something better."""
    endless = bool(np.any(problem.endless))
    most = nets.parameters.polished_endless if endless else nets.parameters.polished
    worth = nets.parameters.worth
    reached: list[float] = []
    order = _one_of_a_kind(problem, seeds, nets.parameters) if endless else range(len(seeds))
    for k in order[: 2 * most]:
        check_stop()
        point = problem.point(seeds.joints[:, :, k], seeds.bases[k])
        hopeless = objective_of(cell, problem.arm, point.joints) > min(worth * search.best, nets.known)
        if nets.late or _count(reached) >= most or hopeless:
            break
        known = min(nets.parameters.beaten * search.best, nets.known)
        found = nets.solve(cell, point, known) or _as_it_is(cell, problem, seeds.take(np.array([k])))
        reached += [objective for objective, _ in found] or [np.inf]
        search.optima += found


def _one_of_a_kind(problem: UnreducedProblem, seeds: Seeds, parameters: UnreducedParameters) -> list[int]:
    """Indices of seeds, without those that break nothing and cost what an earlier one does that breaks nothing."""
    found = figures(problem, seeds, problem.arm.min_conditioning or 0.0)
    clean = likely(problem, found, parameters) & (found.error < MOVED_ERROR)
    kept: list[int] = []
    for k, cost in enumerate(found.cost):
        violates = found.violation[k] > 0.0
        others = [i for i in kept if clean[i] and (found.violation[i] > 0.0) == violates]
        if not (clean[k] and any(abs(cost - found.cost[i]) <= SAME_COST * cost for i in others)):
            kept.append(k)
    return kept


def _count(reached: list[float]) -> int:
    """How many different objectives there are; every failure counts."""
    ordered = sorted(reached)
    return len(ordered) - sum(b <= a * (1.0 + SAME_OBJECTIVE) < np.inf for a, b in pairwise(ordered))


def _as_it_is(cell: Cell, problem: UnreducedProblem, seed: Seeds) -> list[Optimum]:
    """A candidate that a local solve failed from, if it is usable itself: brought exactly onto the task, no more."""
    exact = on_task(problem.narrowed(INSIDE), seed)
    points = [problem.point(exact.joints[:, :, k], base) for k, base in enumerate(exact.bases)]
    usable = [point for point in points if check(cell, problem.arm, point).usable]
    return [(objective_of(cell, problem.arm, point.joints), point) for point in usable]


def _recombined(found: Staged, nets: _Nets) -> Seeds:
    """Candidates recombined at the best bases, those that the stages did not leave already first.

    Where no candidate of the stages takes every pose, the bases are those of the seeds that were left before.
    """
    parameters, middle = nets.parameters, found.middle
    bases = found.seeds.bases if len(found.seeds) else found.pool.bases
    which = distinct_bases(bases, parameters.bases, parameters.near_base)
    seeds = recombined(middle, bases[which], found.pool, parameters, nets.seed)
    how = Iterations(parameters.final_iterations, parameters.key_pull, parameters.stiff)
    seeds = settled(middle, best_windings(middle, gauss_newton(middle, seeds, how)), parameters)
    carriage = over_carriage(middle, bases[which], parameters)  # exact already: iterations would move it elsewhere
    seeds = seeds if carriage is None else carriage.join(seeds)
    seeds = carried(found.problem, seeds, found.middle_poses, parameters)
    both = found.seeds.join(ranked(found.problem, seeds, parameters)[0])
    order = np.arange(len(both))
    kept = distinct(found.problem, both, order, len(both), parameters.near_joints, parameters.near_base)
    return both.take(kept[kept >= len(found.seeds)])


def _over_region(problem: UnreducedProblem, nets: _Nets) -> Seeds:
    """Paths of an arm on a linear axis from bases all over the region; none of other arms."""
    middle, poses = middle_problem(problem, nets.parameters)
    found = over_carriage(middle, spread_bases(problem, nets.parameters.carriage_bases, nets.seed), nets.parameters)
    if found is None:
        return Seeds(np.empty((problem.dof, len(problem.positions), 0)), np.empty((0, 4)))
    return ranked(problem, carried(problem, found, poses, nets.parameters), nets.parameters)[0]


def _follow(cell: Cell, problem: UnreducedProblem, search: UnreducedSearch, nets: _Nets) -> None:
    """Paths followed from random postures."""
    paths, count = follow(cell, problem, nets.seed, nets.deadline)
    search.evaluated += count
    if paths:
        bases = np.array([[*(path.position - problem.origin), path.yaw] for path in paths])
        seeds = Seeds(np.stack([path.joints.T for path in paths], axis=2), bases)
        if np.any(problem.endless):
            seeds = _settled_paths(problem, seeds, nets.parameters)
        _polish(cell, problem, search, ranked(problem, seeds, nets.parameters)[0], nets)


def _settled_paths(problem: UnreducedProblem, seeds: Seeds, parameters: UnreducedParameters) -> Seeds:
    """Followed paths, whose bases are where they were drawn, at their optima: the best, as many as are cheap."""
    most = max(FOLLOWED_WORK // len(problem.positions), parameters.whole_kept)
    seeds, _ = ranked(problem, seeds, parameters)
    seeds = settled(problem, seeds.take(np.arange(min(most, len(seeds)))), parameters)
    return well_conditioned(problem, seeds, parameters)
