"""The outer loop of the penalty methods: Φ minimised for one value of the parameter after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter

from duocell.models.base.arrays import Floats
from duocell.optimizer.baselines.conjugate_gradients import Point, fletcher_reeves
from duocell.optimizer.baselines.gradient import Followed
from duocell.optimizer.baselines.penalty_rows import Barrier, ConstrainedPosture, Penalty, exterior
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.results.layout import PenaltyCycle

LARGEST = 1e10
"""Exterior r beyond which Φ is all penalty."""


@dataclass(frozen=True, slots=True)
class PenaltySettings:
    """Schedule of the parameters.

    Attributes:
        shrink: factor of r' from cycle to cycle (the source's 0.3).
        barrier: size of the first barrier relative to E.
        tolerance: the interior method ends when what its barrier can still hide is below this fraction of E.
        grow: factor of r from cycle to cycle. first: first r.
        cycles: most cycles of one phase.
        margin: rad and m; by how much the exterior method tightens the rows, since it ends outside otherwise.
        phase_margin: rad and m; the same where it prepares the interior method.
    """

    shrink: float = 0.3
    barrier: float = 1.0
    tolerance: float = 1e-5
    grow: float = 10.0
    first: float = 10.0
    cycles: int = 40
    margin: float = 1e-5
    phase_margin: float = 1e-3


@dataclass(frozen=True, eq=False, slots=True)
class Cycles:
    """Runs phases of one posture and keeps the trace.

    Attributes:
        constrained: the posture with its rows.
        rules: schedule.
        deadline: `time.perf_counter` value at which the phases end with what they have.
        trace: filled while running.
    """

    constrained: ConstrainedPosture
    rules: PenaltySettings
    deadline: float
    trace: list[PenaltyCycle]

    def worst(self, path: Followed) -> float:
        """Largest row [rad or m]."""
        return float(self.constrained.rows(path).max())

    def outside(self, path: Followed, margin: float, enough: float) -> Followed:
        """Exterior cycles from any path, until the largest row is at most ``enough``."""
        for parameter in self._growing():
            path = self._cycle(path, "exterior", parameter, exterior(parameter, margin))
            if self.worst(path) <= enough or perf_counter() > self.deadline:
                break
        return path

    def inside(self, path: Followed, barrier: Barrier) -> Followed:
        """Interior cycles from a path strictly inside, until the barrier hides nothing worth having."""
        energy = self.constrained.function.objective
        parameter = self.rules.barrier * max(energy(path), 1e-9) / barrier.amount(self.constrained.rows(path))
        for _ in range(self.rules.cycles):
            path = self._cycle(path, "interior", parameter, barrier.penalty(parameter))
            hidden = parameter * barrier.amount(self.constrained.rows(path))
            if hidden <= self.rules.tolerance * energy(path) or perf_counter() > self.deadline:
                break
            parameter *= self.rules.shrink
        return path

    def _growing(self) -> Iterator[float]:
        parameter = self.rules.first
        for _ in range(self.rules.cycles):
            if parameter > LARGEST:
                return
            yield parameter
            parameter *= self.rules.grow

    def _cycle(self, path: Followed, phase: str, parameter: float, penalty: Penalty) -> Followed:
        """Minimise one Φ and write the line of the trace."""
        constrained = self.constrained

        def evaluate(free: Floats, near: Point[Followed]) -> Point[Followed] | None:
            check_stop()
            return constrained.step(free, near.state, penalty)

        start = constrained.at(path, penalty)
        if start is None:  # an exact singularity: no gradient to follow
            return path
        descent = fletcher_reeves(evaluate, start, stop=lambda _: perf_counter() > self.deadline)
        path = descent.point.state
        self.trace.append(
            PenaltyCycle(
                phase=phase,
                parameter=parameter,
                penalised=descent.point.value,
                objective=constrained.function.objective(path),
                placement=path.placement,
                worst=self.worst(path),
                iterations=descent.iterations,
                evaluations=descent.evaluations + 1,
            )
        )
        return path
