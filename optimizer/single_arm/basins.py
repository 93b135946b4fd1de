"""Basins of one arm's cost: which candidates lead to an optimum that is known, and which optima are distinct."""

from __future__ import annotations

import numpy as np

from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_fully
from duocell.optimizer.reduction.screening import Candidate

LEVEL = 1e-4
"""Relative rise of the cost that counts as level."""
ROUNDED = 1e-6
"""m and rad by which a local optimum may seem to break limits that are active."""
FRACTIONS = np.linspace(0.0, 1.0, 9)
"""Places looked at on the way from a candidate to an optimum."""


def elsewhere(problem: ReducedProblem, candidates: list[Candidate], optimum: ArmSolution) -> list[Candidate]:
    """Candidates that are not in the basin of an optimum.

    In its basin is a candidate of the same posture from which the way is straight downhill to the optimum: violation
    falls until there is none, and from there on the cost.
    """
    if not candidates:
        return []
    places = np.array([candidate.position for candidate in candidates])
    signs = np.array([candidate.signs for candidate in candidates])
    lines = places[:, None, :] + FRACTIONS[:, None] * (optimum.position - places)[:, None, :]
    paths = evaluate_fully(problem, lines.reshape(-1, 3), np.repeat(signs, len(FRACTIONS), axis=0))
    objective = paths.objective[0].reshape(len(places), -1)
    violation = paths.violation[0].reshape(len(places), -1)
    violation[:, -1] = 0.0  # but for rounding
    usable = violation[:, :-1] <= ROUNDED
    least = np.minimum.accumulate(np.where(usable, objective[:, :-1], np.inf), axis=1)
    falling = objective[:, 1:] <= (1.0 + LEVEL) * least
    easing = np.diff(violation, axis=1) < ROUNDED
    downhill = np.all(easing & (falling | ~usable), axis=1)
    return [
        candidate
        for candidate, same_basin in zip(candidates, downhill, strict=True)
        if not (same_basin and candidate.signs == optimum.signs)
    ]


def distinct_optima(optima: list[tuple[float, ArmSolution]]) -> list[tuple[float, int]]:
    """Distinct optima and how often each was reached: same posture, cost within 1e-5, base within a millimetre."""
    groups: list[tuple[float, ArmSolution, int]] = []
    for objective, point in optima:
        for index, (value, other, hits) in enumerate(groups):
            if (
                point.signs == other.signs
                and abs(objective - value) <= 1e-5 * max(1.0, value)
                and bool(np.all(np.abs(point.position - other.position) < 1e-3))
            ):
                groups[index] = (value, other, hits + 1)
                break
        else:
            groups.append((objective, point, 1))
    return [(value, hits) for value, _, hits in groups]
