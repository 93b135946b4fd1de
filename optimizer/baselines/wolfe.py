"""A line search for the strong Wolfe conditions that survives a domain it cannot see.

Bracketing and zooming with safeguarded cubic steps (Nocedal and Wright, Numerical Optimization, 2006, algorithms 3.5
and 3.6). A trial outside the domain (no inverse kinematics, or not in the feasible interior) counts as infinitely
high: it bounds the bracket and the next trial bisects, which is the backtracking of a penalty method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Trial(Generic[T]):
    """A point on the line.

    Attributes:
        step: its place on the line.
        value: of the function; ``inf`` outside the domain.
        slope: derivative along the line; meaningless outside the domain.
        point: whatever the caller wants back.
    """

    step: float
    value: float
    slope: float
    point: T | None


@dataclass(frozen=True, slots=True)
class WolfeSettings:
    """Conditions and limits.

    Attributes:
        decrease: c1, fraction of the predicted decrease that is enough.
        curvature: c2; below 1/2, or Fletcher-Reeves directions need not descend.
        trials: most evaluations of one search.
    """

    decrease: float = 1e-4
    curvature: float = 0.1
    trials: int = 30

    def high(self, trial: Trial[T], origin: Trial[T]) -> bool:
        """True without the decrease that is enough, also outside the domain."""
        return not trial.value <= origin.value + self.decrease * trial.step * origin.slope

    def flat(self, trial: Trial[T], origin: Trial[T]) -> bool:
        """True if the slope is small enough."""
        return abs(trial.slope) <= -self.curvature * origin.slope


def search_line(
    try_step: Callable[[float], Trial[T]],
    origin: Trial[T],
    first: float,
    longest: float,
    settings: WolfeSettings | None = None,
) -> Trial[T] | None:
    """A step with sufficient decrease and, unless the trials run out, small slope.

    Args:
        try_step: evaluates a step > 0.
        origin: step 0, with a negative slope.
        first: first step to try.
        longest: no step beyond this.
        settings: conditions.

    Returns:
        The step, or None if no step with sufficient decrease was found.
    """
    rules = settings or WolfeSettings()
    low, step = origin, min(first, longest)
    far: Trial[T] | None = None
    for _ in range(rules.trials):
        trial = try_step(step)
        if rules.high(trial, origin) or (low is not origin and trial.value >= low.value):
            far = trial
        elif rules.flat(trial, origin):
            return trial
        elif far is None:
            if trial.slope >= 0.0:
                low, far = trial, low
            elif step >= longest:
                return trial
            else:
                low = trial
        else:
            if trial.slope * (far.step - trial.step) >= 0.0:
                far = low
            low = trial
        if far is None:
            step = min(3.0 * step, longest)
        else:
            step = _between(low, far)
            if abs(far.step - low.step) <= 1e-14 * max(low.step, far.step):
                break
    return None if low is origin else low


def _between(low: Trial[T], far: Trial[T]) -> float:
    """Minimiser of the cubic through two trials, kept off their ends; the middle where there is no cubic."""
    width = far.step - low.step
    middle = low.step + 0.5 * width
    if not isfinite(far.value):
        return middle
    d1 = low.slope + far.slope - 3.0 * (far.value - low.value) / width
    square = d1 * d1 - low.slope * far.slope
    if square < 0.0:
        return middle
    d2 = sqrt(square) if width > 0.0 else -sqrt(square)
    bottom = far.slope - low.slope + 2.0 * d2
    if bottom == 0.0:
        return middle
    step = far.step - width * (far.slope + d2 - d1) / bottom
    near, away = low.step + 0.05 * width, far.step - 0.05 * width
    return min(max(step, min(near, away)), max(near, away))
