"""Uniform samples of the box."""

from __future__ import annotations

import numpy as np

from bench.comparison.problem import BATCH, Problem


def search(problem: Problem, seed: int) -> None:
    """Sample until stopped."""
    rng = np.random.default_rng(seed)
    while True:
        problem.costs(rng.uniform(problem.low, problem.high, (BATCH, len(problem.low))))
