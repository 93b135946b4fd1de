"""`scipy.optimize.differential_evolution` with its defaults, started again with the next seed when it has converged."""

from __future__ import annotations

from itertools import count

import numpy as np
from scipy.optimize import differential_evolution

from bench.problem import Problem


def search(problem: Problem, seed: int) -> None:
    """Evolve until stopped."""
    bounds = list(zip(problem.low, problem.high, strict=True))
    for attempt in count():
        rng = np.random.default_rng([seed, attempt])
        if problem.batched:
            differential_evolution(lambda x: problem.costs(x.T), bounds, rng=rng, vectorized=True, updating="deferred")
        else:
            differential_evolution(lambda x: float(problem.costs(x[None])[0]), bounds, rng=rng)
