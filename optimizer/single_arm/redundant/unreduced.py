"""Search of one arm that has no reduced problem: seven joints, no closed form, or a tilted first axis.

Stages of Gauss-Newton leave a few candidates, IPOPT polishes them (`optimizer.single_arm.redundant.stages`). Two
further nets are cast where joints have more than one turn, where the task is uneven, or where candidates had to give
way: paths recombined from all seeds' postures, and paths followed from random postures (`optimizer.continuation`).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from models.arm import TURN, Arm
from models.arrays import Floats
from models.cell import Cell
from optimizer.layers import LayeredPath, finish_path
from optimizer.measure import objective_of
from optimizer.program import ArmPoint
from optimizer.single_arm.redundant.gauss_newton import Iterations, gauss_newton
from optimizer.single_arm.redundant.parameters import PARAMETERS, UnreducedParameters
from optimizer.single_arm.redundant.ranking import distinct, lifted
from optimizer.single_arm.redundant.recombination import distinct_bases, recombined
from optimizer.single_arm.redundant.stages import Staged, carried, ranked, settled, staged
from optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, unreduced_problem
from optimizer.single_arm.redundant.varied_paths import INSIDE, follow, on_task
from optimizer.verify import check
from optimizer.watch import check_stop

Optimum = tuple[float, ArmPoint]
Solver = Callable[[ArmPoint], list[Optimum]]
"""A local solve: the usable optimum reached from a start, or nothing."""
UNEVEN = 1.4
"""Times the mean weight of the poses looked at; steady tasks of one weight stay below."""
CHEAPER = 0.99
"""A candidate that costs less than this share of the best optimum has been changed much on its way there."""
SAME_OBJECTIVE = 1e-6
"""Relative; optima nearer than that are one."""
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
) -> UnreducedSearch:
    """Search the unreduced problem of one arm.

    Args:
        cell: task and step limit. arm: the arm. box: (3, 2) m from `optimizer.box.search_box`.
        seed: of the draws. deadline: `time.perf_counter` value, soft.
        solve: polishes a candidate. parameters: of the stages.
    """
    search = UnreducedSearch()
    problem = unreduced_problem(cell, arm, box)
    for round_ in range(ROUNDS):
        _round(cell, problem, search, _Nets(seed + round_, deadline, solve, parameters))
        if search.optima or time.perf_counter() > deadline:
            break
    return search


@dataclass(frozen=True, eq=False, slots=True)
class _Nets:
    """What a round is made with; see `search_unreduced`."""

    seed: int
    deadline: float
    solve: Solver
    parameters: UnreducedParameters

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
        if doubtful and not nets.late:
            _polish(cell, problem, search, _recombined(found, nets), nets)
    if (np.any(problem.endless) or not search.optima) and not nets.late:
        _follow(cell, problem, search, nets)
    if not search.optima and found is not None:
        search.paths += [
            finish_path(cell, problem.arm, point.position, point.yaw, point.joints.T.copy())
            for point in (problem.point(found.seeds.joints[:, :, k], base) for k, base in enumerate(found.seeds.bases))
        ]


def many_turns(problem: UnreducedProblem) -> bool:
    """True if some joint has more than a turn."""
    return bool(np.any(problem.upper - problem.lower > TURN))


def uneven(problem: UnreducedProblem) -> bool:
    """True if the task has several jobs, or poses that count for much more or less than others."""
    return len(problem.starts) > 1 or float(np.max(problem.weights)) > UNEVEN * float(np.mean(problem.weights))


def _cheaper(cell: Cell, problem: UnreducedProblem, search: UnreducedSearch, seeds: Seeds) -> bool:
    """True if some candidate costs less than the best optimum: it breaks something, which other postures may not."""
    paths = (seeds.joints[:, :, k].T for k in range(len(seeds)))
    return any(objective_of(cell.task, problem.arm, path) < CHEAPER * search.best for path in paths)


def _polish(cell: Cell, problem: UnreducedProblem, search: UnreducedSearch, seeds: Seeds, nets: _Nets) -> None:
    """Solve from seeds, best first, while they can lead to something better."""
    endless = bool(np.any(problem.endless))
    most = nets.parameters.polished_endless if endless else nets.parameters.polished
    reached: list[float] = []
    for k in range(min(2 * most, len(seeds))):
        check_stop()
        point = problem.point(seeds.joints[:, :, k], seeds.bases[k])
        hopeless = objective_of(cell.task, problem.arm, point.joints) > nets.parameters.worth * search.best
        if nets.late or _count(reached) >= most or (hopeless and not endless):
            break
        found = nets.solve(point) or _as_it_is(cell, problem, seeds.take(np.array([k])))
        reached += [objective for objective, _ in found] or [np.inf]
        search.optima += found


def _count(reached: list[float]) -> int:
    """How many different objectives there are; every failure counts."""
    ordered = sorted(reached)
    return len(ordered) - sum(b <= a * (1.0 + SAME_OBJECTIVE) < np.inf for a, b in pairwise(ordered))


def _as_it_is(cell: Cell, problem: UnreducedProblem, seed: Seeds) -> list[Optimum]:
    """A candidate that a local solve failed from, if it is usable itself: brought exactly onto the task, no more."""
    narrow = replace(problem, lower=problem.lower + INSIDE, upper=problem.upper - INSIDE)
    exact = on_task(narrow, seed)
    points = [problem.point(exact.joints[:, :, k], base) for k, base in enumerate(exact.bases)]
    usable = [point for point in points if check(cell, problem.arm, point).usable]
    return [(objective_of(cell.task, problem.arm, point.joints), point) for point in usable]


def _recombined(found: Staged, nets: _Nets) -> Seeds:
    """Candidates recombined at the best bases, those that the stages did not leave already first."""
    parameters, middle = nets.parameters, found.middle
    which = distinct_bases(found.seeds.bases, parameters.bases, parameters.near_base)
    seeds = recombined(middle, found.seeds.bases[which], found.pool, parameters, nets.seed)
    how = Iterations(parameters.final_iterations, parameters.key_pull, parameters.stiff)
    seeds = settled(middle, lifted(middle, gauss_newton(middle, seeds, how)), parameters)
    seeds = carried(found.problem, seeds, found.middle_poses, parameters)
    both = found.seeds.join(ranked(found.problem, seeds, parameters)[0])
    order = np.arange(len(both))
    kept = distinct(both, order, len(both), parameters.near_joints, parameters.near_base)
    return both.take(kept[kept >= len(found.seeds)])


def _follow(cell: Cell, problem: UnreducedProblem, search: UnreducedSearch, nets: _Nets) -> None:
    """Paths followed from random postures."""
    paths, count = follow(cell, problem, nets.seed, nets.deadline)
    search.evaluated += count
    if paths:
        bases = np.array([[*(path.position - problem.origin), path.yaw] for path in paths])
        seeds = Seeds(np.stack([path.joints.T for path in paths], axis=2), bases)
        _polish(cell, problem, search, ranked(problem, seeds, nets.parameters)[0], nets)
