"""CMA-ES of the `cma` package on the unit cube, restarted with twice the population (IPOP) when it has converged."""

from __future__ import annotations

import warnings
from itertools import count

import numpy as np

from bench.comparison.problem import Problem

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # it speaks of optional plotting packages when imported
    import cma

SPREAD = 0.3
"""First standard deviation, in edges of the cube: what its documentation suggests."""


def search(problem: Problem, seed: int) -> None:
    """Evolve until stopped."""
    n = len(problem.low)
    rng = np.random.default_rng(seed)
    population = 4 + int(3 * np.log(n))
    for attempt in count():
        options = {
            "bounds": [0.0, 1.0],
            "popsize": population * 2 ** min(attempt, 8),
            "seed": int(rng.integers(1, 2**31)),
            "verbose": -9,
        }
        strategy = cma.CMAEvolutionStrategy(rng.uniform(0.0, 1.0, n), SPREAD, options)
        while not strategy.stop():
            points = np.array(strategy.ask())
            costs = problem.costs(problem.low + points * (problem.high - problem.low))
            strategy.tell(list(points), list(costs))
