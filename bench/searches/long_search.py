"""A long search that knows nothing of duocell's: differential evolution and random multi-start in turns.

It works on the free numbers of `bench.searches.own_ties` with the kinematics of `bench.searches.own_stands`; every
usable pair of bases it meets is remembered, the best of them is its answer, checked by `bench.judges.dense_check`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from time import process_time

import numpy as np
from scipy.optimize import Bounds, minimize

from bench.draws.cell_draw import Known
from bench.judges.dense_check import dense_check
from bench.searches.evolution import evolve
from bench.searches.own_stands import OwnStands, own_stands, own_task
from bench.searches.own_ties import FreeBases, free_bases
from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell

LEAST, MOST, TIMES = 20.0, 60.0, 100.0
"""CPU s that a cell is searched: `TIMES` times what duocell took, between these two."""
MULTI, POLISHED = 3000, 6
"""Random places of one start, and how many of them are polished."""
STEPS = 5e-3, 0.02
"""m and rad; steps of the dense check, where nothing stands in the way."""


@dataclass(frozen=True, slots=True)
class Longest:
    """What a long search found: E, a layout or None, the number of base pairs it looked at, CPU s."""

    objective: float | None
    layout: Known | None
    looked: int
    seconds: float


@dataclass(eq=False)
class Memory:
    """The best usable numbers met so far, several of them: what is best may fail the dense check."""

    deadline: float
    best: list[tuple[float, Floats]] = field(default_factory=list)
    looked: int = 0

    @property
    def over(self) -> bool:
        """True if the time is."""
        return process_time() > self.deadline

    def note(self, objective: Floats, numbers: Floats) -> None:
        """Usable numbers (S, D) with their objective (S,), infinite where they are not usable."""
        self.looked += len(numbers)
        for k in np.argsort(objective)[:8]:
            if np.isfinite(objective[k]):
                self.best.append((float(objective[k]), numbers[k].copy()))
        self.best = sorted(self.best, key=lambda one: one[0])[:200]


def budget(seconds: float) -> float:
    """CPU s for a cell on which duocell spent so many."""
    return float(np.clip(TIMES * seconds, LEAST, MOST))


def long_search(cell: Cell, seconds: float, rng: np.random.Generator) -> Longest:
    """Search a cell of two arms, tied or not, that keeps no distances.

    Args:
        cell: two arms with inverses of our own.
        seconds: CPU time.
        rng: of all that is random.
    """
    began = process_time()
    free = free_bases(cell)
    memory = Memory(began + seconds)
    search = _Search(cell, free, memory)
    while not memory.over:
        search.evolve(rng)
        if not memory.over:
            search.multi_start(rng)
    layout, objective = None, None
    for value, numbers in memory.best:
        known = search.layout(numbers)
        if dense_check(cell, known.stands, known.joints, *STEPS).clean:
            layout, objective = known, value
            break
    return Longest(objective, layout, memory.looked, process_time() - began)


class _Search:
    def __init__(self, cell: Cell, free: FreeBases, memory: Memory) -> None:
        self.cell, self.free, self.memory = cell, free, memory
        self.tasks = [own_task(cell, a) for a in range(2)]
        self.open = free.bounds[:, 1] > free.bounds[:, 0]
        self.scale = sum(task.scale for task in self.tasks)

    def full(self, chosen: Floats) -> Floats:
        """(S, D) numbers from those (S, open) that are free."""
        numbers = np.tile(self.free.bounds[:, 0], (len(chosen), 1))
        numbers[:, self.open] = chosen
        return numbers

    def cost(self, chosen: Floats) -> Floats:
        """(S,) objective with everything that is wrong made dear; what is usable is remembered."""
        numbers = self.full(chosen)
        stands, outside = self.stands(numbers)
        cost, good = np.zeros(len(numbers)), outside <= 0.0
        for one in stands:
            cost += np.min(one.objective + 10.0 * one.wrong, axis=0)
            good &= one.usable.any(axis=0)
        if good.any():
            exact = sum(np.min(np.where(one.usable, one.objective, np.inf), axis=0) for one in stands)
            cost = np.where(good, exact, cost)
            self.memory.note(np.where(good, exact, np.inf), numbers)
        else:
            self.memory.looked += len(numbers)
        penalised: Floats = cost + 10.0 * self.scale * outside
        return penalised

    def stands(self, numbers: Floats) -> tuple[list[OwnStands], Floats]:
        """What both arms do there, and how far bases are outside."""
        places, yaws, outside = self.free.places(numbers)
        found = [own_stands(t, places[a], None if yaws is None else yaws[a]) for a, t in enumerate(self.tasks)]
        return found, outside

    def evolve(self, rng: np.random.Generator) -> None:
        """One run of differential evolution."""
        bounds = self.free.bounds[self.open]
        evolve(self.cost, bounds, lambda: self.memory.over, rng, popsize=20, maxiter=300, tol=1e-6)
        self.polish([numbers[self.open] for _, numbers in self.memory.best[:1]])

    def multi_start(self, rng: np.random.Generator) -> None:
        """Random places, the best of them that are apart polished."""
        low, high = self.free.bounds[self.open].T
        tried, costs = rng.uniform(low, high, (MULTI, len(low))), []
        for some in np.array_split(tried, MULTI // 250):
            costs.append(self.cost(some))
            if self.memory.over:
                return
        order = np.argsort(np.concatenate(costs))
        chosen: list[Floats] = []
        for k in order:
            if all(np.max(np.abs(tried[k] - other) / (high - low)) > 0.1 for other in chosen):
                chosen.append(tried[k])
            if len(chosen) == POLISHED:
                break
        self.polish(chosen)

    def polish(self, starts: list[Floats]) -> None:
        """Nelder and Mead from each start."""
        low, high = self.free.bounds[self.open].T
        for start in starts:
            if self.memory.over:
                return
            span = 0.05 * (high - low)
            simplex = np.vstack([start, *(start + np.diag(np.where(start + span > high, -span, span)))])
            minimize(
                self._cost_of_one,
                start,
                method="Nelder-Mead",
                bounds=Bounds(low, high),
                options={"initial_simplex": simplex, "maxfev": 400, "xatol": 1e-7, "fatol": 1e-9},
            )

    def _cost_of_one(self, numbers: Floats) -> float:
        return float(self.cost(numbers[None])[0])

    def layout(self, numbers: Floats) -> Known:
        """The layout of numbers that are usable."""
        stands, joints = [], []
        places, _, _ = self.free.places(numbers[None])
        for a, one in enumerate(self.stands(numbers[None])[0]):
            branch = int(np.argmin(np.where(one.usable[:, 0], one.objective[:, 0], np.inf)))
            stands.append([*places[a, 0], one.yaw[branch, 0]])
            joints.append(one.joints[branch, 0])
        return Known(np.array(stands), tuple(joints))
