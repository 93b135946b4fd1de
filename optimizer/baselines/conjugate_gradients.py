"""Fletcher-Reeves conjugate gradients, the inner minimiser of the source's penalty methods.

``S = -∇Φ + λ S_prev`` with ``λ = |∇Φ|² / |∇Φ_prev|²``, restarted along the gradient every n steps and whenever a
direction does not descend or its line search fails.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Generic, TypeVar

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.baselines.wolfe import Trial, search_line

T = TypeVar("T")


@dataclass(frozen=True, eq=False, slots=True)
class Point(Generic[T]):
    """A point inside the domain.

    Attributes:
        x: (n,). value: of the function. gradient: (n,).
        state: what the caller needs to evaluate points nearby.
    """

    x: Floats
    value: float
    gradient: Floats
    state: T


@dataclass(frozen=True, slots=True)
class Descent(Generic[T]):
    """Result of a minimisation.

    Attributes:
        point: last and lowest point.
        iterations: line searches. evaluations: of the function with its gradient.
        converged: True if the gradient or the progress fell below the tolerance.
    """

    point: Point[T]
    iterations: int
    evaluations: int
    converged: bool


@dataclass(frozen=True, slots=True)
class DescentSettings:
    """Limits of one minimisation.

    Attributes:
        iterations: most line searches.
        gradient: converged below this length of the gradient, relative to ``1 + |Φ|``.
        progress: converged when n line searches in a row gain less than this, relative to ``1 + |Φ|``.
        first: length of the first step. longest: of any step (m and rad alike).
    """

    iterations: int = 200
    gradient: float = 1e-7
    progress: float = 1e-10
    first: float = 0.02
    longest: float = 0.5


def fletcher_reeves(
    evaluate: Callable[[Floats, Point[T]], Point[T] | None],
    start: Point[T],
    settings: DescentSettings | None = None,
    stop: Callable[[Point[T]], bool] = lambda _: False,
) -> Descent[T]:
    """Minimise a function from a point inside its domain.

    Args:
        evaluate: the point at x, given a point nearby; None outside the domain.
        start: where to begin.
        settings: limits.
        stop: ends the minimisation early at a point that is good enough.
    """
    rules = settings or DescentSettings()
    point, n = start, len(start.x)
    direction, step = -point.gradient, 0.0
    since_restart = idle = iterations = evaluations = 0
    converged = False
    while iterations < rules.iterations and not stop(point):
        length = float(np.linalg.norm(direction))
        scale = 1.0 + abs(point.value)
        if float(np.linalg.norm(point.gradient)) <= rules.gradient * scale or length == 0.0:
            converged = True
            break
        slope = float(point.gradient @ direction)
        if slope >= 0.0:
            direction, since_restart, step = -point.gradient, 0, 0.0
            continue
        found, spent = _search(evaluate, point, direction, slope, step or rules.first / length, rules.longest / length)
        iterations, evaluations = iterations + 1, evaluations + spent
        if found is None or found.point is None:
            if since_restart == 0:
                converged = True  # not even the gradient leads further down, to the precision of the function
                break
            direction, since_restart, step = -point.gradient, 0, 0.0
            continue
        new = found.point
        idle = idle + 1 if point.value - new.value <= rules.progress * scale else 0
        since_restart += 1
        ratio = float(new.gradient @ new.gradient) / float(point.gradient @ point.gradient)
        if since_restart >= n:
            ratio, since_restart = 0.0, 0
        direction = -new.gradient + ratio * direction
        point = new
        downhill = float(point.gradient @ direction)
        # The first order change of the next step is expected to be that of this one.
        step = found.step * slope / downhill if downhill < 0.0 else 0.0
        if idle >= n:
            converged = True
            break
    return Descent(point, iterations, evaluations, converged)


def _search(
    evaluate: Callable[[Floats, Point[T]], Point[T] | None],
    point: Point[T],
    direction: Floats,
    slope: float,
    first: float,
    longest: float,
) -> tuple[Trial[Point[T]] | None, int]:
    """Line search from ``point``; also the number of evaluations."""
    spent = 0

    def try_step(step: float) -> Trial[Point[T]]:
        nonlocal spent
        spent += 1
        new = evaluate(point.x + step * direction, point)
        if new is None:
            return Trial(step, inf, inf, None)
        return Trial(step, new.value, float(new.gradient @ direction), new)

    return search_line(try_step, Trial(0.0, point.value, slope, point), first, longest), spent
