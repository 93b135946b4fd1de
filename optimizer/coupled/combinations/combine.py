"""Combinations of the arms' candidates: which of them fit together, best first."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.optimizer.coupled.combinations.pool import Member, Pool
from duocell.optimizer.coupled.combinations.project_positions import tied
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.refinement import REFINEMENT, RefinementParameters
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.sqp.nearby import nearby
from duocell.optimizer.sqp.refine import penalty_of
from duocell.optimizer.verification.scene import LIMITS, Scene

BEAM = 600
"""Combinations kept while one arm after the other is added."""
LOOKED_AT = 250
"""Combinations whose arms are checked against each other, best first; as many more are taken from all over the rest."""
BATCH = 25
"""Combinations looked at together."""
FEW, MOST_TIED = 200, 3000
"""Where ties leave fewer combinations than that, so many places of the first arm are tried."""
WIDEST_TIED = 300
"""Combinations and members that are tied to each other, all with all."""
ENOUGH = 8
"""Distinct clean combinations after which no more are looked for."""
APART = 0.12
"""m; combinations of the same postures whose bases are all nearer than this count as one start."""


@dataclass(frozen=True, eq=False, slots=True)
class Combination:
    """One point per arm.

    Attributes:
        points: one per arm. objective: E. violation: largest shortfall at the poses [m], <= 0 if none.
    """

    points: tuple[ArmSolution, ...]
    objective: float
    violation: float

    def score(self, penalty: float) -> float:
        """E with the shortfall made dear."""
        return self.objective + penalty * max(self.violation, 0.0)


def combine(
    scene: Scene,
    pools: Sequence[Pool],
    problems: Sequence[ReducedProblem | None],
    effort: int,
    deadline: float,
    refinement: RefinementParameters = REFINEMENT,
) -> list[Combination]:
    """Distinct promising combinations, best first.

    Args:
        scene: the cell. pools: candidates per arm. problems: reduced problem per arm, or None.
        effort: how many times as many combinations to look at as in the first round.
        deadline: `time.perf_counter` value, soft. refinement: of what comes after.
    """
    penalty = penalty_of(scene.cell, refinement)
    candidates = _beam(scene.cell, pools, problems, penalty, BEAM * effort)
    return look_through(scene, _order(candidates, LOOKED_AT * effort), deadline, refinement)


def look_through(
    scene: Scene,
    ordered: Sequence[tuple[Member, ...]],
    deadline: float,
    refinement: RefinementParameters = REFINEMENT,
) -> list[Combination]:
    """Layouts with their violations at the poses, best first, without those beside better ones.

    Args:
        scene: the cell. ordered: layouts, the most promising first; the last ones are left out once `ENOUGH` are clean.
        deadline: `time.perf_counter` value, soft. refinement: of what comes after.
    """
    penalty = penalty_of(scene.cell, refinement)
    looked: list[Combination] = []
    for at in range(0, len(ordered), BATCH):
        check_stop()
        looked = _distinct(
            sorted([*looked, *_checked(scene, ordered[at : at + BATCH])], key=lambda c: c.score(penalty))
        )
        if sum(one.violation <= LIMITS for one in looked) >= ENOUGH or time.perf_counter() > deadline:
            break
    return looked


def _checked(scene: Scene, candidates: Sequence[tuple[Member, ...]]) -> list[Combination]:
    """Combinations with their violations."""
    layouts = [tuple(member.point for member in members) for members in candidates]
    violations = scene.contact_violations(layouts)
    return [
        Combination(
            points,
            sum(member.objective for member in members),
            max(float(violation), scene.tie_violation(points), scene.floor_violation(points)),
        )
        for members, points, violation in zip(candidates, layouts, violations, strict=True)
    ]


def _order(candidates: list[tuple[Member, ...]], count: int) -> list[tuple[Member, ...]]:
    """The best ones, then some from all over the rest: where the best all collide, so do their neighbours."""
    rest = candidates[count:]
    stride = max(1, len(rest) // count)
    return candidates[:count] + rest[::stride]


def _beam(
    cell: Cell,
    pools: Sequence[Pool],
    problems: Sequence[ReducedProblem | None],
    penalty: float,
    width: int,
) -> list[tuple[Member, ...]]:
    """Combinations by the sum of their members' scores, couplings kept or made dear; arms are added one by one."""
    partial: list[tuple[Member, ...]] = [(member,) for member in pools[0].members]
    for index in range(1, len(pools)):
        pool = pools[index]
        ties = [c for c in cell.couplings if index in c.arms and all(arm <= index for arm in c.arms)]
        if ties:
            grown = tied(cell.arms[index], ties, partial[:WIDEST_TIED], pool.members[:WIDEST_TIED], problems[index])
            if len(grown) < FEW and index == 1:  # a tie that leaves no choice: all places of one arm, all postures
                anywhere = [(member,) for member in pools[0].usable[:: max(1, len(pools[0].usable) // MOST_TIED)]]
                grown += tied(cell.arms[index], ties, anywhere, pool.representatives(1), problems[index])
        else:
            grown = _sums(partial, pool.members, penalty, width)
        scores = np.array([sum(member.score(penalty) for member in members) for members in grown])
        partial = [grown[i] for i in np.argsort(scores, kind="stable")[:width]]
    return partial


def _sums(
    partial: list[tuple[Member, ...]], pool: Sequence[Member], penalty: float, width: int
) -> list[tuple[Member, ...]]:
    """The ``width`` best of all pairs of a partial combination and a member."""
    first = np.array([sum(member.score(penalty) for member in members) for members in partial])
    second = np.array([member.score(penalty) for member in pool])
    total: Floats = first[:, None] + second
    best = np.argsort(total, axis=None, kind="stable")[:width]
    return [(*partial[i // len(pool)], pool[i % len(pool)]) for i in map(int, best)]


def _distinct(combinations: list[Combination]) -> list[Combination]:
    """Without those that stand about where an earlier one does, in the same postures."""
    kept: list[Combination] = []
    for one in combinations:
        if not any(nearby(one.points, other.points, APART) for other in kept):
            kept.append(one)
    return kept
