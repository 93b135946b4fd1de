"""Whole layouts out of thousands of stands per arm, by cheap means: what is left is worth a closer look.

The candidates of `optimizer.coupled.pool` are few and looked at closely. Where these lead nowhere, many are looked at
through balls inside of the bodies and couplings as arrays, and every region of pairs has its say.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optimizer.coupled.combine import Combination, look_through
from optimizer.coupled.grown import Grower, Partial
from optimizer.coupled.pool import Member
from optimizer.coupled.refine import nearby
from optimizer.coupled.scene import Scene
from optimizer.coupled.stands import Sieve
from optimizer.reduced import ReducedProblem

LOOKED_AT = 300
"""Layouts that get a closer look."""


def crowded(
    scene: Scene, problems: Sequence[ReducedProblem], seed: int, deadline: float, apart: float = 0.0
) -> tuple[list[Combination], int]:
    """Distinct layouts that do not surely collide, best first, and the number of stands looked at.

    Args:
        scene: the cell. problems: reduced problem of each arm. seed: of the nets.
        deadline: `time.perf_counter` value, soft.
        apart: m; layouts in the same postures are at least so far from better ones.
    """
    sieves: list[Sieve] = []
    partial, evaluated = Partial(()), 0
    for index, problem in enumerate(problems):
        sieves.append(Sieve.of(scene, index, problem))
        stands, spacing, looked = sieves[-1].net(seed)
        evaluated += looked
        if index == 0:
            partial = Partial((stands,))
        else:
            partial = Grower(scene, sieves, spacing, LOOKED_AT, deadline).grown(partial, stands)
        if not len(partial):
            return [], evaluated
    layouts = [
        tuple(Member(s.point(int(row)), float(s.objective[row]), 0.0) for s in partial.stands)
        for row in np.argsort(partial.objective, kind="stable")
    ]
    return look_through(scene, _thinned(layouts, apart) if apart > 0.0 else layouts, deadline), evaluated


def _thinned(layouts: Sequence[tuple[Member, ...]], apart: float) -> list[tuple[Member, ...]]:
    """Layouts, best first, without those near a better one in the same postures."""
    kept: list[tuple[Member, ...]] = []
    for layout in layouts:
        points = [member.point for member in layout]
        if not any(nearby(points, [member.point for member in other], apart) for other in kept):
            kept.append(layout)
    return kept
