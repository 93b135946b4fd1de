"""A long search of one arm, to judge a short one: differential evolution in every posture, then a closer look.

It shares the kinematics with what it judges, but neither its samples, nor its bounds, nor its local solver; it takes
about a hundred times as long.

Source: R. Storn, K. Price, Differential evolution, J. Global Optimization 11 (1997); constraints by the rules of
K. Deb, Computer Methods in Applied Mechanics and Engineering 186 (2000): less violation first, then less cost.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.arm import SINGULAR_WRIST
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed

MEMBERS, GENERATIONS = 32, 150
"""Of a posture."""
CROSSED = 0.9
"""Share of the coordinates that a trial takes from the mutant."""
CLOSER, CLOUD = 44, 24
"""Steps of the closer look and points strewn in each."""
KEPT = 1e-9
"""m and rad; violations that do not count."""


@dataclass(frozen=True, eq=False, slots=True)
class Members:
    """Base positions (N, 3) [m] in postures ``signs`` (N, 3), with cost (N,) and violation (N,)."""

    places: Floats
    signs: Ints
    cost: Floats
    violation: Floats

    def better_than(self, other: Members) -> Bools:
        """(N,) by Deb's rules."""
        less = self.violation < other.violation
        better: Bools = less | ((self.violation == other.violation) & (self.cost < other.cost))
        return better

    def where(self, chosen: Bools, other: Members) -> Members:
        """These where ``chosen`` (N,), else the others."""
        return Members(
            np.where(chosen[:, None], self.places, other.places),
            self.signs,
            np.where(chosen, self.cost, other.cost),
            np.where(chosen, self.violation, other.violation),
        )

    def best(self) -> int:
        """Index of the best member."""
        return int(np.lexsort((self.cost, self.violation))[0])


Wanted = Callable[[Floats, Ints], bool]
"""Whether a base position (3,) in a posture (3,) counts, beyond what is tested here."""


def long_search(
    problem: ReducedProblem, box: Floats, seed: int, rounds: int = 2, wanted: Wanted = lambda place, signs: True
) -> float:
    """The least cost found of a usable path; infinite if none was.

    Args:
        problem: the arm on its whole task.
        box: (3, 2) m, where bases may stand.
        seed: of the chances.
        rounds: independent populations.
        wanted: asked about the best of every posture at the end.
    """
    rng = np.random.default_rng([7, seed])
    found = [_closer(problem, box, _evolved(problem, box, rng), rng, wanted) for _ in range(rounds)]
    return min(found)


def _evolved(problem: ReducedProblem, box: Floats, rng: np.random.Generator) -> Members:
    admitted = np.array(ALL_SIGNS)[problem.postures]
    signs = np.repeat(admitted, MEMBERS, axis=0)
    width = box[:, 1] - box[:, 0]
    count = len(signs)
    members = _judged(problem, box[:, 0] + width * rng.random((count, 3)), signs)
    firsts = np.repeat(np.arange(len(admitted)) * MEMBERS, MEMBERS)
    for _ in range(GENERATIONS if np.any(width > 0.0) else 0):
        a, b, c = (members.places[firsts + rng.integers(0, MEMBERS, count)] for _ in range(3))
        leader = np.array([f + Members.best(_some(members, f)) for f in firsts[::MEMBERS]])
        own = members.places
        towards = rng.random(count)[:, None] < 0.3
        base = np.where(towards, own + 0.7 * (np.repeat(members.places[leader], MEMBERS, axis=0) - own), a)
        mutant = base + rng.uniform(0.4, 0.9, (count, 1)) * (b - c)
        crossed = rng.random((count, 3)) < CROSSED
        places = np.where(crossed, mutant, own)
        away = (places < box[:, 0]) | (places > box[:, 1])
        clipped = rng.random((count, 1)) < 0.5  # optima are often at the edge
        places = np.where(
            away, np.where(clipped, np.clip(places, *box.T), box[:, 0] + width * rng.random((count, 3))), places
        )
        trial = _judged(problem, places, signs)
        members = trial.where(trial.better_than(members), members)
    return members


def _some(members: Members, first: int) -> Members:
    part = slice(first, first + MEMBERS)
    return Members(members.places[part], members.signs[part], members.cost[part], members.violation[part])


def _closer(problem: ReducedProblem, box: Floats, members: Members, rng: np.random.Generator, wanted: Wanted) -> float:
    """The least cost about the best member of every posture."""
    firsts = range(0, len(members.cost), MEMBERS)
    chosen = np.array([f + _some(members, f).best() for f in firsts])
    best = Members(*(values[chosen] for values in (members.places, members.signs, members.cost, members.violation)))
    radius = 0.05 * (box[:, 1] - box[:, 0])
    for _ in range(CLOSER if np.any(radius > 0.0) else 0):
        for _ in range(2):
            strewn = best.places[:, None] + radius * rng.uniform(-1.0, 1.0, (len(chosen), CLOUD, 3))
            near = np.clip(strewn, box[:, 0], box[:, 1]).reshape(-1, 3)
            trial = _judged(problem, near, np.repeat(best.signs, CLOUD, axis=0))
            order = np.lexsort((trial.cost, trial.violation, np.repeat(np.arange(len(chosen)), CLOUD)))[::CLOUD]
            front = Members(trial.places[order], best.signs, trial.cost[order], trial.violation[order])
            best = front.where(front.better_than(best), best)
        radius = 0.7 * radius
    rows = np.flatnonzero(best.violation == 0.0)
    return min((float(best.cost[k]) for k in rows if wanted(best.places[k], best.signs[k])), default=np.inf)


def _judged(problem: ReducedProblem, places: Floats, signs: Ints) -> Members:
    paths = evaluate_signed(problem, places, signs)
    violation, cost = paths.violation[0].copy(), paths.objective[0]
    violation[violation <= KEPT] = 0.0
    joints, arm = paths.joints[:, 0], problem.arm
    if arm.avoid_singularities:
        off = np.abs(np.mod(joints[4] - problem.form.wrist_zero + np.pi / 2, np.pi) - np.pi / 2)
        violation += np.maximum(SINGULAR_WRIST - np.min(off, axis=1), 0.0)
    rows = np.flatnonzero(violation == 0.0)
    if arm.min_conditioning is not None and len(rows):
        flat = joints[:, rows].reshape(6, -1).T
        values = conditioning_of(chain_of(arm.robot), arm.tool, flat, characteristic_length(arm.robot))
        worst = np.min(values.reshape(len(rows), -1), axis=1)
        violation[rows] += np.maximum(arm.min_conditioning - worst, 0.0)
    violation[~np.isfinite(violation)] = np.inf
    return Members(places, signs, cost, violation)
