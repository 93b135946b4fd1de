"""`scipy.optimize.minimize(method="SLSQP")` from uniform random starts, gradients by forward differences.

A vectorised objective gets all differences of a gradient in one call.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import Bounds, minimize

from bench.comparison.problem import Problem
from duocell.models.base.arrays import Floats

STEP = 1e-7


def search(problem: Problem, seed: int) -> None:
    """Start again and again until stopped."""
    rng = np.random.default_rng(seed)
    n, bounds = len(problem.low), Bounds(problem.low, problem.high)

    def cost(x: Floats) -> float:
        return float(problem.costs(x[None])[0])

    def cost_and_gradient(x: Floats) -> tuple[float, Floats]:
        # Backwards where a step forwards would leave the box.
        steps = np.where(x + STEP > problem.high, -STEP, STEP)
        values = problem.costs(np.vstack([x, x + np.diag(steps)]))
        return float(values[0]), (values[1:] - values[0]) / steps

    while True:
        start = rng.uniform(problem.low, problem.high, n)
        if problem.batched:
            minimize(cost_and_gradient, start, jac=True, method="SLSQP", bounds=bounds, options={"maxiter": 200})
        else:
            minimize(cost, start, method="SLSQP", bounds=bounds, options={"maxiter": 200})
