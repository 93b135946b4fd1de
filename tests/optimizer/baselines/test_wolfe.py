from collections.abc import Callable
from math import cos, inf, log, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.optimizer.baselines.wolfe import Trial, WolfeSettings, search_line

RULES = WolfeSettings()


def _search(
    value: Callable[[float], float], slope: Callable[[float], float], first: float = 0.1, longest: float = 100.0
) -> tuple[Trial[float] | None, list[float]]:
    calls: list[float] = []

    def try_step(step: float) -> Trial[float]:
        calls.append(step)
        return Trial(step, value(step), slope(step), step)

    return search_line(try_step, Trial(0.0, value(0.0), slope(0.0), 0.0), first, longest), calls


@given(
    centre=st.floats(0.01, 50.0),
    scale=st.floats(1e-3, 1e3),
    first=st.floats(1e-4, 100.0),
    ripple=st.floats(0.0, 0.8),
)
def test_strong_wolfe_conditions_hold(centre: float, scale: float, first: float, ripple: float) -> None:
    def value(t: float) -> float:
        return scale * ((t - centre) ** 2 + ripple * centre * sin(t))

    def slope(t: float) -> float:
        return scale * (2.0 * (t - centre) + ripple * centre * cos(t))

    found, calls = _search(value, slope, first)
    assert found is not None
    assert found.value <= value(0.0) + RULES.decrease * found.step * slope(0.0)
    assert abs(found.slope) <= RULES.curvature * abs(slope(0.0)) or len(calls) == RULES.trials
    assert len(calls) < RULES.trials


@given(wall=st.floats(0.01, 10.0), first=st.floats(1e-3, 100.0))
def test_a_wall_is_backtracked_from(wall: float, first: float) -> None:
    """Falls all the way to a wall behind which the function does not exist."""

    def value(t: float) -> float:
        return -t - 1e-3 * log(wall - t) if t < wall else inf

    def slope(t: float) -> float:
        return -1.0 + 1e-3 / (wall - t) if t < wall else inf

    found, _ = _search(value, slope, first)
    assert found is not None
    assert 0.0 < found.step < wall
    assert abs(found.slope) <= RULES.curvature * abs(slope(0.0))


def test_a_hard_wall_without_a_minimum_still_gives_a_lower_step() -> None:
    found, calls = _search(lambda t: -t if t < 1.0 else inf, lambda t: -1.0)
    assert found is not None
    assert found.step == pytest.approx(1.0, abs=1e-3)
    assert len(calls) <= RULES.trials


def test_the_longest_step_ends_a_search_that_keeps_falling() -> None:
    found, _ = _search(lambda t: -t, lambda t: -1.0, longest=7.0)
    assert found is not None
    assert found.step == 7.0


def test_no_step_where_the_slope_lies() -> None:
    found, calls = _search(lambda t: t, lambda t: -1.0)
    assert found is None
    assert len(calls) <= RULES.trials
