r"""The linearised problem of a box and what its solution proves.

In a box the errors ``e = q - q*`` of the joints are ``v(y) + δ`` with v linear in y (base position relative to the
centre, and yaw shift of joint 1) and ``|δ| <= r``. By weak duality any numbers t and any multipliers μ, ν >= 0 of the
limits bound Σ w e² from below (docs/method.md, section 7.6). Good ones come from the minimiser of
``Σ w v² + K Σ violation²``, which projected Newton steps find, K growing on the way where limits are in play; every
stage gives a bound, the best one counts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats, Ints

FIRST_STEPS = 3
"""Newton steps with limits hardly felt (K = 1)."""
PENALTIES = (1e1, 1e2, 1e2, 1e3, 1e3, 1e4, 1e5)
"""K of the following steps, relative to the largest weight, for problems in which limits are in play."""


ROUNDING = 1e-12
"""rad, added to every remainder: large multipliers must not make rounding count."""


@dataclass(frozen=True, eq=False, slots=True)
class Linear:
    """The linearised problems of N boxes: P rows (joints times poses), V variables.

    Attributes:
        error: (N, P) rad, v(0). slopes: (N, P, V). rest: (N, P) rad, r.
        weights: (N, P) w; 0 for rows that do not take part.
        limits: (2, N, P) rad, e̲ and ē; infinite where no multiplier may be used.
        low: (N, V) lower ends of the variables. high: (N, V) upper ends.
    """

    error: Floats
    slopes: Floats
    rest: Floats
    weights: Floats
    limits: Floats
    low: Floats
    high: Floats

    def __getitem__(self, rows: Ints) -> Linear:
        limits = self.limits[:, rows]
        ends = self.low[rows], self.high[rows]
        return Linear(self.error[rows], self.slopes[rows], self.rest[rows], self.weights[rows], limits, *ends)

    def line(self, y: Floats) -> Floats:
        """(N, P) v(y)."""
        line: Floats = self.error + (self.slopes @ y[..., None])[..., 0]
        return line

    def violation(self, line: Floats) -> Floats:
        """(N, P) how far rows are above their upper limit (positive) or below the lower one (negative)."""
        over: Floats = np.maximum(line - self.limits[1], 0.0) - np.maximum(self.limits[0] - line, 0.0)
        return over

    def solve(self, y: Floats) -> tuple[Floats, Floats]:
        """(N, V) about the minimisers, starting from ``y``, and (N,) the best bounds found on the way."""
        y = np.clip(y, self.low, self.high)
        for _ in range(FIRST_STEPS):
            y = self._newton(y, 1.0)
        bound = self.dual_value(y, 1.0)
        rows = np.flatnonzero(np.any(self.violation(self.line(y)) != 0.0, axis=1))
        if len(rows):
            part, z = self[rows], y[rows]
            for penalty in PENALTIES:
                z = part._newton(z, penalty)
                bound[rows] = np.maximum(bound[rows], part.dual_value(z, penalty))
            y[rows] = z
        return y, bound

    def inside(self, y: Floats) -> Floats:
        """(N, V) a point near the minimiser ``y`` that keeps the limits, if the box has one."""
        short = 2.0 * np.max(np.abs(self.violation(self.line(y))), axis=1, keepdims=True) + 1e-9
        return replace(self, limits=self.limits + np.stack([short, -short])).solve(y)[0]

    def _penalty(self, relative: float) -> Floats:
        """(N, 1) K."""
        largest = np.max(self.weights, axis=1, keepdims=True)
        penalty: Floats = relative * np.where(largest > 0.0, largest, 1.0)
        return penalty

    def _newton(self, y: Floats, relative: float) -> Floats:
        """One Newton step in the variables that are not held at an end."""
        line, penalty = self.line(y), self._penalty(relative)
        over = self.violation(line)
        pull = (self.weights * line + penalty * over)[:, None]
        gradient = (pull @ self.slopes)[:, 0]
        curvature = self.weights + penalty * (over != 0.0)
        hessian = np.swapaxes(self.slopes * curvature[..., None], 1, 2) @ self.slopes
        held = ((y <= self.low) & (gradient > 0.0)) | ((y >= self.high) & (gradient < 0.0))
        hessian[held] = 0.0
        np.swapaxes(hessian, 1, 2)[held] = 0.0
        diagonal = np.arange(y.shape[1])
        scale = np.max(np.abs(hessian), axis=(1, 2))[:, None]
        hessian[:, diagonal, diagonal] += np.where(scale > 0.0, scale, 1.0) * (held + 1e-12)
        step = np.linalg.solve(hessian, np.where(held, 0.0, gradient)[..., None])[..., 0]
        return np.clip(y - step, self.low, self.high)

    def dual_value(self, y: Floats, relative: float) -> Floats:
        """(N,) lower bound of ``Σ w e²``, by tangents at ``y`` and the penalty's multipliers there."""
        line = self.line(y)
        over = self.violation(line)
        push = self._penalty(relative) * over  # half of μ - ν
        factors = 2.0 * (self.weights * line + push)  # λ
        limit = np.where(over > 0.0, self.limits[1], np.where(over < 0.0, self.limits[0], 0.0))
        constant = factors * self.error - self.weights * line**2 - 2.0 * push * limit
        gradient = (factors[:, None] @ self.slopes)[:, 0]
        least = np.minimum(gradient * self.low, gradient * self.high)
        value: Floats = np.sum(constant - np.abs(factors) * (self.rest + ROUNDING), axis=1) + np.sum(least, axis=1)
        return value
