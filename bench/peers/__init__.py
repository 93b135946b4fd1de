"""General methods that people use instead: one file each, with a ``search(problem, seed)`` that ends by `Enough`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from bench.comparison.problem import Problem
from bench.peers import cma_es, differential_evolution, grid, optuna_tpe, random_search, slsqp


@dataclass(frozen=True, slots=True)
class Peer:
    """One method.

    Attributes:
        name: as in the tables.
        search: runs until the problem raises `Enough`.
        joint: True if its users would search all arms together; False if arm by arm (maps are made of one robot).
    """

    name: str
    search: Callable[[Problem, int], None]
    joint: bool = True


PEERS = (
    Peer("SciPy differential evolution", differential_evolution.search),
    Peer("SciPy SLSQP, multi-start", slsqp.search),
    Peer("CMA-ES with restarts (cma)", cma_es.search),
    Peer("TPE (Optuna)", optuna_tpe.search),
    Peer("capability-map style grid", grid.search, joint=False),
    Peer("random search", random_search.search),
)
