"""A long search among obstacles that knows nothing of duocell's: differential evolution, random starts, descents.

It works on the free numbers of `bench.searches.own_ties`. What balls inside of the bodies let pass and is better than
all before is followed and looked at by Coal before it counts (`bench.draws.cell_draw.keeps_clear`), and in the end by
the dense check.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time

import numpy as np

from bench.draws.cell_draw import Known, base_frames, coarse, keeps_clear
from bench.judges.dense_check import dense_check
from bench.judges.dense_path import follow, object_steps
from bench.searches.evolution import evolve
from bench.searches.long_search import Longest
from bench.searches.obstructed_arm import DEEP, Looks, ObstructedArm
from bench.searches.own_ties import free_bases
from duocell.models.base.arrays import Bools, Floats
from duocell.models.cell.cell import Cell

STEPS = 2e-3, 0.01
"""m and rad; steps of the dense check."""
RANDOM, KEPT, APART, DESCENTS, POPULATION = 2000, 200, 0.1, 4, 32
"""Random places of one round, those of them that are looked at, how far apart starts are, how many, and points of one
step of a descent."""
LOOKED_AT = 3
"""Candidates of one batch that are looked at by Coal."""


@dataclass(frozen=True, eq=False)
class Confirmed:
    """A layout that Coal found clean at coarse steps: E, free numbers (D,), layout."""

    objective: float
    numbers: Floats
    layout: Known


def obstructed_search(
    cell: Cell, scale: float, seconds: float, rng: np.random.Generator, starts: list[Floats] | None = None
) -> Longest:
    """Search a cell of two arms among obstacles.

    Args:
        cell: two arms with inverses of our own, at most one coupling.
        scale: m, of the cell, for the coarse steps.
        seconds: CPU time.
        rng: of all that is random.
        starts: bases (2, 4) of layouts from which descents begin.
    """
    began = process_time()
    search = _Search(cell, scale, began + seconds)
    for stands in starts or []:
        search.descend(search.free.numbers_of(stands)[search.open], rng, 0.03)
    while not search.over:
        search.random_starts(rng)
        if not search.over:
            search.evolve(rng)
    layout, objective = None, None
    for found in reversed(search.found):
        if dense_check(cell, found.layout.stands, found.layout.joints, *STEPS).clean:
            layout, objective = found.layout, found.objective
            break
    return Longest(objective, layout, search.looked, process_time() - began)


class _Search:
    def __init__(self, cell: Cell, scale: float, deadline: float) -> None:
        self.cell, self.deadline, self.looked = cell, deadline, 0
        self.free = free_bases(cell)
        self.open = self.free.bounds[:, 1] > self.free.bounds[:, 0]
        self.arms = [ObstructedArm(cell, a) for a in range(2)]
        self.scale = sum(arm.scale for arm in self.arms)
        self.coarse, self.at_poses = coarse(cell.task, scale), object_steps(cell.task.poses, np.inf, np.inf)
        self.found: list[Confirmed] = []

    @property
    def over(self) -> bool:
        """True if the time is."""
        return process_time() > self.deadline

    @property
    def best(self) -> float:
        """E of the best layout so far."""
        return self.found[-1].objective if self.found else np.inf

    def _full(self, chosen: Floats) -> Floats:
        numbers = np.tile(self.free.bounds[:, 0], (len(chosen), 1))
        numbers[:, self.open] = chosen
        return numbers

    def least(self, chosen: Floats) -> Floats:
        """(S,) E of numbers (S, open) if nothing were in the way."""
        places, yaws, outside = self.free.places(self._full(chosen))
        some = [arm.least(places[a], None if yaws is None else yaws[a]) for a, arm in enumerate(self.arms)]
        return some[0] + some[1] + 10.0 * self.scale * outside

    def cost(self, chosen: Floats) -> Floats:
        """(S,) E of numbers (S, open), with everything that is wrong made dear; what is best is looked at by Coal."""
        numbers = self._full(chosen)
        places, yaws, outside = self.free.places(numbers)
        self.looked += len(numbers)
        looks = [arm.look(places[a], None if yaws is None else yaws[a]) for a, arm in enumerate(self.arms)]
        totals = looks[0].value[:, None] + looks[1].value[None, :]  # (B, B, S)
        usable = looks[0].usable[:, None] & looks[1].usable[None, :] & (outside <= 0.0)
        violation = self._together(looks, usable)
        totals = totals + DEEP * self.scale * violation + 10.0 * self.scale * outside
        self._look(numbers, places, looks, totals, usable & (violation <= 0.0))
        cost: Floats = np.min(totals, axis=(0, 1))
        return cost

    def _together(self, looks: list[Looks], usable: Bools) -> Floats:
        """(B, B, S) m, how much too near to each other the balls of two arms are that are usable by themselves."""
        violation = np.zeros(usable.shape)
        required = self.cell.surroundings.clearances.arm_arm
        if required is None:
            return violation
        reach = self.arms[0].radii[:, None] + self.arms[1].radii[None, :] + required
        for i, j, s in np.argwhere(usable):
            first, second = looks[0].centres[i, s], looks[1].centres[j, s]
            square = np.sum(first**2, axis=2)[:, :, None] + np.sum(second**2, axis=2)[:, None, :]
            square -= 2.0 * first @ second.swapaxes(1, 2)
            violation[i, j, s] = max(float(np.max(reach - np.sqrt(np.maximum(square, 0.0)))), 0.0)
        return violation

    def _look(self, numbers: Floats, places: Floats, looks: list[Looks], totals: Floats, usable: Bools) -> None:
        """Look at the best of a batch; what is not clean becomes dear."""
        better = np.argwhere(usable & (totals < self.best * (1.0 - 1e-7)))
        for i, j, s in sorted(better, key=lambda at: float(totals[tuple(at)]))[:LOOKED_AT]:
            branch = (i, j)
            stands = np.array([[*places[a, s], looks[a].yaw[branch[a], s]] for a in range(2)])
            layout = Known(stands, tuple(looks[a].joints[branch[a], s] for a in range(2)))
            if self.clean(layout):
                self.found.append(Confirmed(float(totals[i, j, s]), numbers[s].copy(), layout))
                return
            totals[i, j, s] += 0.01 * self.scale
            if self.over:
                return

    def clean(self, layout: Known) -> bool:
        """True if nothing is wrong at the poses, nor at coarse steps between them."""
        stands, joints = layout.stands, layout.joints
        if not keeps_clear(self.cell, stands, (joints[0], joints[1]), self.at_poses, 0.0):
            return False
        paths = []
        for arm, base, q in zip(self.cell.arms, base_frames(self.cell, stands), joints, strict=True):
            path, lost = follow(arm, base, self.coarse, q)
            if lost is not None:
                return False
            paths.append(path)
        return keeps_clear(self.cell, stands, (paths[0], paths[1]), self.coarse, 0.0)

    def evolve(self, rng: np.random.Generator) -> None:
        """One run of differential evolution, and a descent from what is best then."""
        evolve(self.cost, self.free.bounds[self.open], lambda: self.over, rng, popsize=12, maxiter=100, tol=1e-5)
        if self.found:
            self.descend(self.found[-1].numbers[self.open], rng, 0.02)

    def random_starts(self, rng: np.random.Generator) -> None:
        """Random places; descents from the best of them that are apart."""
        low, high = self.free.bounds[self.open].T
        tried = rng.uniform(low, high, (RANDOM, len(low)))
        least = np.concatenate([self.least(some) for some in np.array_split(tried, RANDOM // 250)])
        tried, costs = tried[np.argsort(least)[:KEPT]], []
        for some in np.array_split(tried, KEPT // 50):
            costs.append(self.cost(some))
            if self.over:
                return
        chosen: list[Floats] = []
        for k in np.argsort(np.concatenate(costs)):
            if all(np.max(np.abs(tried[k] - other) / (high - low)) > APART for other in chosen):
                chosen.append(tried[k])
            if len(chosen) == DESCENTS:
                break
        for start in chosen:
            self.descend(start, rng, 0.05)

    def descend(self, start: Floats, rng: np.random.Generator, share: float) -> None:
        """Points about the best one, the cloud of them growing where it helps; ``share`` of the bounds at first."""
        low, high = self.free.bounds[self.open].T
        best, value = start, float(self.cost(start[None])[0])
        while share > 1e-5 and not self.over:
            tried = best + rng.normal(0.0, share, (POPULATION, len(low))) * (high - low)
            costs = self.cost(np.clip(tried, low, high))
            k = int(np.argmin(costs))
            if costs[k] < value:
                best, value, share = np.clip(tried[k], low, high), float(costs[k]), min(1.3 * share, 0.1)
            else:
                share *= 0.6
