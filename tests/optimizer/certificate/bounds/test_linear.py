from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.optimize import Bounds, LinearConstraint, minimize

from duocell.models.base.arrays import Floats
from duocell.optimizer.certificate.bounds.linear import Linear


def random_linear(
    rng: np.random.Generator, count: int, rows: int = 24, variables: int = 3, limits: float = 0.6
) -> Linear:
    """Problems whose box always holds the point 0 inside all limits."""
    slopes = rng.normal(size=(count, rows, variables))
    error = rng.normal(size=(count, rows))
    ends = np.stack(
        [error - limits * rng.uniform(0.05, 3.0, error.shape), error + limits * rng.uniform(0.05, 3.0, error.shape)]
    )
    return Linear(
        error=error,
        slopes=slopes,
        rest=np.zeros_like(error),
        weights=rng.uniform(0.0, 2.0, error.shape),
        limits=ends,
        low=-rng.uniform(0.0, 1.0, (count, variables)),
        high=rng.uniform(0.0, 1.0, (count, variables)),
    )


def cost(linear: Linear, k: int, y: Floats, off: Floats | float = 0.0) -> float:
    return float(linear.weights[k] @ (linear.error[k] + linear.slopes[k] @ y + off) ** 2)


def test_the_dual_value_is_below_every_allowed_point_even_with_remainders() -> None:
    rng = np.random.default_rng(1)
    linear = random_linear(rng, 50)
    rest = np.abs(rng.normal(size=linear.error.shape)) * 0.05
    rough = Linear(linear.error, linear.slopes, rest, linear.weights, linear.limits, linear.low, linear.high)
    anywhere = rng.uniform(rough.low, rough.high)  # any tangent points and multipliers will do, not only good ones
    for bound in (rough.solve(np.zeros((50, 3)))[1], rough.dual_value(anywhere, 10.0), rough.dual_value(anywhere, 1e4)):
        for k in range(50):
            for _ in range(30):
                place, off = rng.uniform(rough.low[k], rough.high[k]), rest[k] * rng.uniform(-1.0, 1.0, 24)
                line = rough.error[k] + rough.slopes[k] @ place + off
                if np.all((line >= rough.limits[0, k]) & (line <= rough.limits[1, k])):
                    assert bound[k] <= cost(rough, k, place, off) + 1e-9
            assert bound[k] <= cost(rough, k, np.zeros(3)) + 1e-9


def test_without_remainders_it_is_the_constrained_minimum() -> None:
    rng = np.random.default_rng(2)
    linear = random_linear(rng, 25)
    y, bound = linear.solve(np.zeros((25, 3)))
    inside = linear.inside(y)
    close = 0
    for k in range(25):
        rows = linear.slopes[k]
        kept = LinearConstraint(rows, linear.limits[0, k] - linear.error[k], linear.limits[1, k] - linear.error[k])
        bounds = Bounds(linear.low[k], linear.high[k])
        best = minimize(partial(cost, linear, k), np.zeros(3), method="SLSQP", bounds=bounds, constraints=kept).fun
        assert bound[k] <= best + 1e-6
        close += bound[k] > best - 1e-3 * (1.0 + best)
        line = linear.error[k] + rows @ inside[k]
        keeps = np.all((line >= linear.limits[0, k] - 1e-9) & (line <= linear.limits[1, k] + 1e-9))
        if keeps:
            assert cost(linear, k, inside[k]) >= best - 1e-6
    assert close >= 20


def test_rows_can_be_taken_apart() -> None:
    linear = random_linear(np.random.default_rng(3), 6)
    y = np.zeros((6, 3))
    some = np.array([4, 1])
    assert linear[some].solve(y[some])[1] == pytest.approx(linear.solve(y)[1][some])
