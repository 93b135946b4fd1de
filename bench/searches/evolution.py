"""Differential evolution as the long searches run it: vectorised, without scipy's own polish, until told to stop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import Bounds, OptimizeResult, differential_evolution

from duocell.models.base.arrays import Floats


def evolve(
    costs: Callable[[Floats], Floats],
    bounds: Floats,
    over: Callable[[], bool],
    rng: np.random.Generator,
    *,
    popsize: int,
    maxiter: int,
    tol: float,
) -> None:
    """One run; what is found is for ``costs`` to remember.

    Args:
        costs: (N,) of candidates (N, d).
        bounds: (d, 2).
        over: asked after every generation.
        rng: draws.
        popsize, maxiter, tol: as of scipy.
    """

    def stop(intermediate_result: OptimizeResult) -> None:
        if over():
            raise StopIteration

    def of_columns(columns: Floats) -> Floats:
        return costs(columns.T)

    differential_evolution(
        of_columns,  # type: ignore[arg-type]  # the stubs know of no vectorised objective
        Bounds(bounds[:, 0], bounds[:, 1]),
        popsize=popsize,
        maxiter=maxiter,
        tol=tol,
        mutation=(0.4, 1.0),
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=rng,
        callback=stop,
    )
