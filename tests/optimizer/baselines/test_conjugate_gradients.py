from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.optimizer.baselines.conjugate_gradients import Descent, DescentSettings, Point, fletcher_reeves
from tests.support.present import present


def _descend(
    value: Callable[[Floats], float],
    gradient: Callable[[Floats], Floats],
    start: Floats,
    inside: Callable[[Floats], bool] = lambda x: True,
    rules: DescentSettings | None = None,
    stop: Callable[[Point[None]], bool] = lambda point: False,
) -> Descent[None]:
    def evaluate(x: Floats, _near: Point[None] | None) -> Point[None] | None:
        return Point(x, value(x), gradient(x), None) if inside(x) else None

    return fletcher_reeves(evaluate, present(evaluate(start, None)), rules, stop)


@given(seed=st.integers(0, 10_000), n=st.integers(1, 4), spread=st.floats(0.0, 2.0))
@settings(deadline=None)
def test_quadratics_are_solved(seed: int, n: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(n, n)))
    hessian = turn @ np.diag(10.0 ** rng.uniform(-spread / 2, spread / 2, n)) @ turn.T
    goal = rng.uniform(-1.0, 1.0, n)
    descent = _descend(
        lambda x: float((x - goal) @ hessian @ (x - goal)), lambda x: 2.0 * hessian @ (x - goal), np.zeros(n)
    )
    assert descent.converged
    assert descent.point.x == pytest.approx(goal, abs=1e-3)


def test_rosenbrock_is_solved() -> None:
    def value(x: Floats) -> float:
        return float((1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2)

    def gradient(x: Floats) -> Floats:
        bend = x[1] - x[0] ** 2
        return np.array([-2 * (1 - x[0]) - 400 * x[0] * bend, 200 * bend])

    descent = _descend(value, gradient, np.array([-1.2, 1.0]), rules=DescentSettings(iterations=2000, progress=1e-14))
    assert descent.point.x == pytest.approx([1.0, 1.0], abs=1e-3)


def test_the_domain_is_never_left_and_the_value_never_rises() -> None:
    seen = []

    def value(x: Floats) -> float:
        return float(x @ x)

    def inside(x: Floats) -> bool:
        seen.append(x)
        return bool(x[0] > 0.5)  # the minimum lies behind a wall

    descent = _descend(value, lambda x: 2.0 * x, np.array([2.0, 1.0]), inside)
    assert descent.point.x[0] > 0.5
    assert descent.point.value < 5.0
    assert any(x[0] <= 0.5 for x in seen)


def test_it_stops_where_it_is_told_to() -> None:
    descent = _descend(
        lambda x: float(x @ x), lambda x: 2.0 * x, np.array([9.0]), stop=lambda point: point.value < 30.0
    )
    assert 1.0 < descent.point.value < 30.0


def test_a_stationary_start_needs_no_search() -> None:
    descent = _descend(lambda x: float(x @ x), lambda x: 2.0 * x, np.zeros(2))
    assert (descent.converged, descent.iterations, descent.evaluations) == (True, 0, 0)
