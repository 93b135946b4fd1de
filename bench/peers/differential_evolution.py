"""`scipy.optimize.differential_evolution` with its defaults, started again with the next seed when it has converged."""

from __future__ import annotations

from itertools import count

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from bench.comparison.problem import Problem
from duocell.models.base.arrays import Floats


def search(problem: Problem, seed: int) -> None:
    """Evolve until stopped."""
    bounds = Bounds(problem.low, problem.high)

    def costs(columns: Floats) -> Floats:
        return problem.costs(columns.T)

    def cost(x: Floats) -> float:
        return float(problem.costs(x[None])[0])

    for attempt in count():
        rng = np.random.default_rng([seed, attempt])
        if problem.batched:
            # The stubs know of no vectorised objective.
            differential_evolution(costs, bounds, rng=rng, vectorized=True, updating="deferred")  # type: ignore[arg-type]
        else:
            differential_evolution(cost, bounds, rng=rng)
