"""One descent: trust-region steps on a merit that makes violations dear, from a layout to the foot of its slope."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.monitoring.events import Iterated
from duocell.optimizer.monitoring.watch import check_stop, tell
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.refinement import RefinementParameters
from duocell.optimizer.sqp.linear_rows import LinearRows
from duocell.optimizer.sqp.linearisation import Linearisation, linearise
from duocell.optimizer.sqp.manifold import Unknowns, move
from duocell.optimizer.sqp.nearby import nearby
from duocell.optimizer.sqp.quadratic import Quadratic, quadratic
from duocell.optimizer.sqp.step import Step, best_step
from duocell.optimizer.verification.scene import Scene


@dataclass(frozen=True, eq=False, slots=True)
class Terms:
    """What a descent is given.

    Attributes:
        scene: the cell. margins: m, what to ask for beyond the required distance of a class.
        penalty: cost of a metre or radian of violation, in units of E.
        worth: relative fall of the merit below which a round was the last one.
        deadline: `time.perf_counter` value, soft.
        ends: layouts that are known; a descent that comes into the basin of one of them ends.
        beat: E; a descent that does not seem to lead to less is given up.
        parameters: of the stage.
    """

    scene: Scene
    margins: Mapping[PairClass, float]
    penalty: float
    worth: float
    deadline: float
    ends: Sequence[Sequence[ArmSolution]]
    beat: float
    parameters: RefinementParameters

    @property
    def unknowns(self) -> Unknowns:
        """Of the cell's layouts."""
        return Unknowns.of(self.scene.cell)

    def merit(self, at: Linearisation) -> float:
        """E with the violation made dear."""
        return at.objective + self.penalty * max(at.violation, 0.0)

    def seen(self, points: Sequence[ArmSolution]) -> Linearisation:
        """What a layout is like."""
        return linearise(self.scene, self.unknowns, points, self.margins)


@dataclass(frozen=True, eq=False, slots=True)
class _Trial:
    """A step that was tried: where it leads, what the merit falls by there, and by how much it was said to fall."""

    there: Linearisation
    gained: float
    promised: float


def descend(terms: Terms, here: Linearisation) -> tuple[Linearisation, int]:
    """Where a layout leads, and how many programs were solved on the way."""
    descent = _Descent(terms, here)
    for round_ in range(terms.parameters.rounds):
        check_stop()
        tell(Iterated(round_, descent.here.objective, max(descent.here.violation, 0.0)))
        if descent.over:
            return descent.here, round_
        trial = descent.trial()
        if trial is None:
            descent.radius *= terms.parameters.shorter
            continue
        descent.take(trial)
        if descent.ended(round_, trial):
            return descent.here, round_ + 1
    return descent.here, terms.parameters.rounds


@dataclass(eq=False, slots=True)
class _Descent:
    """Where a descent is.

    Attributes:
        terms: its terms. here: the layout. radius: m that a base may move. violations: m or rad, violations so far.
    """

    terms: Terms
    here: Linearisation
    radius: float = field(init=False)
    violations: list[float] = field(default_factory=list)
    _model: Quadratic | None = None

    def __post_init__(self) -> None:
        self.radius = self.terms.parameters.radius
        self.violations.append(self.here.violation)

    @property
    def over(self) -> bool:
        """True where no further step is worth its time."""
        return (
            self.radius < self.terms.parameters.smallest_radius
            or time.perf_counter() > self.terms.deadline
            or self._stuck
        )

    @property
    def _stuck(self) -> bool:
        """True where something is violated and that gets no better any more."""
        parameters, violations = self.terms.parameters, self.violations
        rounds, share = parameters.stuck
        return (
            violations[-1] > parameters.margin
            and len(violations) > rounds
            and violations[-1] > (1.0 - share) * violations[-1 - rounds]
        )

    @property
    def _merit(self) -> float:
        return self.terms.merit(self.here)

    @property
    def _least(self) -> float:
        """What a step has to promise."""
        return self.terms.worth * max(self._merit, 1e-9)

    def trial(self) -> _Trial | None:
        """The best step of this radius; None where it leads nowhere."""
        terms, here = self.terms, self.here
        if self._model is None:
            self._model = quadratic(terms.scene.cell, here.points, here.along, terms.unknowns)
        model = self._model
        bounds = _reach(terms.scene.cell, here.points, terms.unknowns, self.radius, terms.parameters)
        step, moved, straight = self._step(model, here.rows, bounds)
        if step is None or moved is None:
            return None
        promised = terms.penalty * (max(here.violation, 0.0) - step.slack) - model.change(step.step)
        if promised <= self._least and not straight:
            return None
        there = terms.seen(moved)
        if here.followed and not there.followed:
            return None
        gained = self._merit - terms.merit(there)
        if gained < terms.parameters.poor * promised and there.violation > max(here.violation, 0.0):
            corrected = self._corrected(there, model, step, bounds)
            if corrected is not None and self._merit - terms.merit(corrected) > gained:
                there, gained = corrected, self._merit - terms.merit(corrected)
        return _Trial(there, gained, promised)

    def take(self, trial: _Trial) -> None:
        """Go there, if that is downhill, and trust the model more or less."""
        parameters = self.terms.parameters
        if trial.gained < parameters.poor * trial.promised:
            self.radius *= parameters.short
        elif trial.gained > parameters.good * trial.promised:
            self.radius = min(parameters.longer * self.radius, parameters.largest_radius)
        if trial.gained > 0.0:
            self.here, self._model = trial.there, None
        self.violations.append(self.here.violation)

    def ended(self, round_: int, trial: _Trial) -> bool:
        """True after a step to the foot of the slope, into a basin that is known, or towards nothing better."""
        terms, parameters = self.terms, self.terms.parameters
        if (
            round_ >= parameters.settled
            and self._merit - parameters.patience * max(trial.promised, trial.gained) > terms.beat
        ):
            return True
        known = any(nearby(self.here.points, points, parameters.same_basin) for points in terms.ends)
        return known or trial.promised <= self._least

    def _corrected(
        self, there: Linearisation, model: Quadratic, step: Step, bounds: tuple[Floats, Floats]
    ) -> Linearisation | None:
        """Where a step leads that heeds how the rows bend: with rows made where the straight one ended.

        The second-order correction of R. Fletcher, Practical Methods of Optimization, 1987, section 14.4: without it
        rows that bend make every step short that goes along them.
        """
        rows = there.rows
        seen_from_here = replace(rows, values=rows.values - rows.gradients @ step.step)
        _, moved, _ = self._step(model, seen_from_here, bounds)
        return None if moved is None else self.terms.seen(moved)

    def _step(
        self, model: Quadratic, rows: LinearRows, bounds: tuple[Floats, Floats]
    ) -> tuple[Step | None, tuple[ArmSolution, ...] | None, bool]:
        """The best step and where it leads; None where some arm does not reach its task there.

        A step that ends beyond the end of reach, which bends, is made anew with so much more of it left; False for
        such.
        """
        terms, here = self.terms, self.here
        for count in range(terms.parameters.nearer + 1):
            step = best_step(model, rows, *bounds, terms.penalty)
            if step is None:
                break
            moved, missing = move(terms.scene.cell, here.points, here.along, terms.unknowns, step.step)
            if missing == 0.0:
                return step, moved, count == 0
            if np.isinf(missing) or not np.any(rows.reach):
                break
            rows = rows.nearer(terms.parameters.beyond * missing)
        return step, None, False


def _reach(
    cell: Cell, points: Sequence[ArmSolution], unknowns: Unknowns, radius: float, parameters: RefinementParameters
) -> tuple[Floats, Floats]:
    """(C,) bounds of a step: the trust region, and the base regions."""
    upper = np.full(unknowns.count, parameters.nullspace * radius)
    lower = -upper
    for a, (arm, point) in enumerate(zip(cell.arms, points, strict=True)):
        own, region = unknowns.base(a), arm.base.bounds
        if arm.base.yaw_free:
            region[3] = -np.inf, np.inf
        place = np.array([*point.position, point.yaw])
        reach = np.array([radius] * 3 + [parameters.turn * radius])
        lower[own] = np.maximum(-reach, np.minimum(region[:, 0] - place, 0.0))
        upper[own] = np.minimum(reach, np.maximum(region[:, 1] - place, 0.0))
    return lower, upper
