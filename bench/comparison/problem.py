"""What a search method is given, in two forms, and the clock that watches it.

- `FullProblem`: as a user of a general optimiser would pose it. One vector (x, y[, z], yaw per arm); per candidate the
  inverse kinematics of every pose, the best posture, and a penalty on what is not allowed. Candidates one by one.
  The inverse kinematics are ours, vectorised over the poses of a path.
- `ReducedProblem`: our own formulation. One arm, its base position only; the best yaw and windings come in closed form
  and a whole batch of candidates is evaluated at once. What is compared here is the search alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import process_time
from typing import Protocol

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.baselines.gradient import paths_at
from duocell.optimizer.reduction import reduced
from duocell.optimizer.reduction.reduced import Paths, evaluate

PENALTY = 1e3
"""Objective per m or rad of violation, more than any constraint of these tasks is worth at the optimum."""
USABLE = 1e-9
"""m or rad; a violation below this is rounding."""
BATCH = 64
"""Candidates that vectorised methods evaluate at once."""
AT_ONCE = 4096
"""Poses × candidates evaluated in one go, to stay in the cache."""


class Enough(Exception):
    """Budget spent or target reached: an end, not an error."""


class Clock:
    """Counts evaluations and notes every improvement.

    Its seconds are CPU seconds of this process: every method of the benchmark runs in one thread of one process, and
    CPU time does not depend on what else the machine is doing.

    Attributes:
        trace: (CPU seconds since the start, best E so far), falling.
        evaluations: candidates seen.
    """

    def __init__(self, budget: float, target: float) -> None:
        self.budget, self.target = budget, target
        self.trace: list[tuple[float, float]] = []
        self.evaluations = 0
        self.started = process_time()

    @property
    def best(self) -> float:
        """Best E so far; infinite before the first feasible candidate."""
        return self.trace[-1][1] if self.trace else np.inf

    def saw(self, value: float, count: int = 1) -> None:
        """Note ``count`` candidates, the best of which scored ``value`` (infinite: none was feasible).

        Raises:
            Enough: time to stop.
        """
        now = process_time() - self.started
        self.evaluations += count
        if value < self.best:
            self.trace.append((now, float(value)))
        if now > self.budget or self.best <= self.target:
            raise Enough


class Problem(Protocol):
    """Minimise ``costs`` over a box until `Enough` is raised."""

    low: Floats
    high: Floats
    batched: bool
    clock: Clock

    def costs(self, candidates: Floats) -> Floats:
        """Penalised objective (N,) of candidates (N, d)."""


class FullProblem:
    """Some arms of a cell, one candidate at a time."""

    batched = False

    def __init__(self, cell: Cell, arms: Sequence[Arm], clock: Clock) -> None:
        self.clock = clock
        self._problems = [_reduced(cell, arm) for arm in arms]
        boxes = np.concatenate([arm.base.bounds for arm in arms])  # (4 arms, 2)
        self._free = boxes[:, 0] < boxes[:, 1]
        self._fixed = boxes[:, 0].copy()
        self.low, self.high = boxes[self._free, 0], boxes[self._free, 1]

    def costs(self, candidates: Floats) -> Floats:
        """See `Problem`."""
        return np.array([self._cost(candidate) for candidate in candidates])

    def _cost(self, candidate: Floats) -> float:
        full = self._fixed.copy()
        full[self._free] = np.clip(candidate, self.low, self.high)
        total = usable = 0.0
        for problem, placement in zip(self._problems, full.reshape(-1, 4), strict=True):
            merit, value = _merit(paths_at(problem, placement))
            total, usable = total + float(merit[0]), usable + float(value[0])
        self.clock.saw(usable)
        return total


class ReducedProblem:
    """One arm, its base position only, many candidates at once."""

    batched = True

    def __init__(self, cell: Cell, arm: Arm, clock: Clock) -> None:
        self.clock = clock
        self._problem = _reduced(cell, arm)
        box = arm.base.bounds[:3]
        self._free = box[:, 0] < box[:, 1]
        self._fixed = box[:, 0].copy()
        self.low, self.high = box[self._free, 0], box[self._free, 1]

    def costs(self, candidates: Floats) -> Floats:
        """See `Problem`."""
        positions = np.tile(self._fixed, (len(candidates), 1))
        positions[:, self._free] = np.clip(candidates, self.low, self.high)
        pieces = []
        size = max(1, AT_ONCE // len(self._problem.positions))
        for first in range(0, len(positions), size):
            piece = positions[first : first + size]
            merit, value = _merit(evaluate(self._problem, piece))
            self.clock.saw(float(value.min()), len(piece))
            pieces.append(merit)
        return np.concatenate(pieces)


def _merit(paths: Paths) -> tuple[Floats, Floats]:
    """Per candidate (N,): penalised objective of the best posture, and E of the best usable one (else infinite)."""
    violation = paths.violation
    merit = np.min(paths.objective + PENALTY * violation, axis=0)
    value = np.min(np.where(violation <= USABLE, paths.objective, np.inf), axis=0)
    return merit, value


def _reduced(cell: Cell, arm: Arm) -> reduced.ReducedProblem:
    problem = reduced.reduced_problem(cell, arm)
    if problem is None:
        raise ValueError(f"{arm.name} has no closed form: not a task of this benchmark")
    return problem
