"""A least σmin/σmax kept by tangents: it has no closed form in CasADi, so the program gets linear rows, renewed.

Source of the filter: R. Fletcher, S. Leyffer, Nonlinear programming without a penalty function, Mathematical
Programming 91 (2002).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.arm import Arm
from duocell.optimizer.nlp.program import ArmSolution, Cuts
from duocell.optimizer.nlp.solve import Solve

CUT_ROUNDS = 25
TRUST, SMALLEST_TRUST, ALLOWED = 0.4, 1e-3, 0.1
"""rad that joints may move in a round of cuts, at first and at least; share of the conditioning a round may lose."""
CLOSE = 0.002
"""Share of the conditioning that an answer may miss if the next one may be further away, and at most is to make up."""
SHRINK, HALVE, GROW = 0.3, 0.5, 1.5
"""What becomes of the radius with an answer that is refused, violates something, or does not."""
LESS = 0.01
"""An answer with a higher objective must violate the conditioning by at least this share less than all before."""
NUDGE = 1e-4
"""Cuts aim at this fraction more than what is asked for, so that their last error does no harm."""
SETTLED = 1e-7
"""Relative change of the objective below which renewed cuts have nothing more to say."""
DIFFERENCE = 1e-6
"""rad, step of the central differences of the conditioning."""

CutSolver = Callable[[ArmSolution, Cuts, float], Solve]
"""Solves the program with cuts from a point, whose joints may move by a radius [rad]."""


def keep_conditioning(
    solve: CutSolver, arm: Arm, start: ArmSolution, deadline: float, radius: float = np.inf
) -> Solve | None:
    """Solve with tangents of σmin/σmax >= min_conditioning, renewed at every answer until they no longer move it.

    Fixed points satisfy the optimality conditions of the constraint itself. With a finite ``radius`` [rad] joints may
    leave the last accepted answer by no more than that; an answer that is worse than an earlier one in objective and
    conditioning (a filter), or where the tangents promised too much, is refused and the radius shrinks. Without one,
    the way is shorter but may lose itself.

    Args:
        solve: of the program with tangents. arm: the arm. start: where to begin.
        deadline: `time.perf_counter` value, soft.
        radius: rad.

    Returns:
        The best answer that holds the constraint, or None.
    """
    rounds = _Rounds(arm, start, radius)
    for _ in range(CUT_ROUNDS):
        result = solve(rounds.point, rounds.cuts, rounds.radius)
        if time.perf_counter() > deadline or rounds.radius < SMALLEST_TRUST or not rounds.go_on_from(result):
            break
    return rounds.best


@dataclass(eq=False, slots=True)
class _Rounds:
    """Where the rounds of cuts stand.

    Attributes:
        arm: the arm. point: the last accepted answer. radius: rad that joints may move from it.
        best: the cheapest answer that holds the constraint.
    """

    arm: Arm
    point: ArmSolution
    radius: float
    best: Solve | None = None
    _values: Floats = field(init=False)  # σmin/σmax at the point, and its derivatives
    _gradients: Floats = field(init=False)
    _extra: float = 0.0  # conditioning asked for beyond what is wanted: answers to rows that bend miss a little
    _before: float = np.inf  # objective of the last accepted answer
    _filter: list[tuple[float, float]] = field(default_factory=list)  # objective and violation of accepted answers

    def __post_init__(self) -> None:
        self._values, self._gradients = conditioning_gradients(self.arm, self.point.joints)

    @property
    def _wanted(self) -> float:
        return float(self.arm.min_conditioning or 0.0)

    @property
    def cuts(self) -> Cuts:
        """Tangents at the point."""
        return _cuts(self.point.joints, self._wanted + self._extra, self._values, self._gradients)

    def go_on_from(self, result: Solve) -> bool:
        """Accept or refuse an answer; False where no further round is of use."""
        if not result.status.has_point:
            return self._refuse()
        values, gradients = conditioning_gradients(self.arm, result.points[0].joints)
        violation = self._violation(values)
        if violation == 0.0 and self._is_settled(result.objective):
            self._note_best(result)
            return False
        lost = np.isfinite(self.radius) and violation > self._violation(self._values) + ALLOWED * self._wanted
        if lost or self._is_dominated(result.objective, violation):
            return self._refuse()
        self.point, self._values, self._gradients = result.points[0], values, gradients
        self._trust(violation)
        self._filter.append((result.objective, violation))
        self._before = result.objective
        if violation == 0.0:
            self._note_best(result)
        return True

    def _refuse(self) -> bool:
        """Trust the tangents less; False where they are trusted without bounds."""
        self.radius *= SHRINK
        return bool(np.isfinite(self.radius))

    def _trust(self, violation: float) -> None:
        """Trust the tangents as far as the answer kept what they promised, and ask for what it missed by."""
        close = CLOSE * self._wanted
        self.radius *= GROW if violation <= close else HALVE
        if violation == 0.0:
            self._extra *= SHRINK
        elif violation <= close:
            self._extra = min(self._extra + violation, close)

    def _is_settled(self, objective: float) -> bool:
        """True if renewed cuts no longer move the answer."""
        before = self._before
        return bool(np.isfinite(before)) and abs(objective - before) <= SETTLED * max(1.0, before)

    def _note_best(self, result: Solve) -> None:
        if self.best is None or result.objective < self.best.objective:
            self.best = result

    def _violation(self, values: Floats) -> float:
        return max(self._wanted - float(np.min(values)), 0.0)

    def _is_dominated(self, objective: float, violation: float) -> bool:
        """True if an accepted answer is about as good in the objective and in the violation of the conditioning."""
        return any(
            objective >= (1.0 - SETTLED) * known and violation >= (1.0 - LESS) * violated
            for known, violated in self._filter
        )


def _cuts(joints: Floats, wanted: float, values: Floats, gradients: Floats) -> Cuts:
    near = values < 2.0 * wanted
    bounds = np.where(near, wanted * (1.0 + NUDGE) - values + np.sum(gradients * joints, axis=1), -np.inf)
    return Cuts(np.where(near[:, None], gradients, 0.0), bounds)


def conditioning_gradients(arm: Arm, joints: Floats) -> tuple[Floats, Floats]:
    """σmin/σmax (m,) and its derivative by the joints (m, n), by central differences."""
    chain, length = chain_of(arm.robot), characteristic_length(arm.robot)
    m, n = joints.shape
    offsets = np.concatenate([np.zeros((1, n)), DIFFERENCE * np.eye(n), -DIFFERENCE * np.eye(n)])
    values = conditioning_of(chain, arm.tool, (joints[:, None, :] + offsets).reshape(-1, n), length)
    values = values.reshape(m, 2 * n + 1)
    return values[:, 0], (values[:, 1 : n + 1] - values[:, n + 1 :]) / (2.0 * DIFFERENCE)
