"""A regular grid over the box, as capability and reachability maps are made, refined again and again.

A map has one resolution; halving the step until time is up makes it an anytime method and is to its advantage.
"""

from __future__ import annotations

from itertools import count, islice, product

import numpy as np

from bench.comparison.problem import BATCH, Problem


def search(problem: Problem, seed: int) -> None:
    """Grids of 4, 8, 16, ... cells a side, at the cells' centres; deterministic, ``seed`` is not used."""
    del seed
    for level in count(2):
        steps = (np.arange(2**level) + 0.5) / 2**level
        cells = product(steps, repeat=len(problem.low))
        while chunk := list(islice(cells, BATCH)):
            problem.costs(problem.low + np.array(chunk) * (problem.high - problem.low))
