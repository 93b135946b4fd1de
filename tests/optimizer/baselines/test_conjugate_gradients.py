import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from duocell.optimizer.baselines.conjugate_gradients import DescentSettings, Point, fletcher_reeves


def _descend(value, gradient, start, inside=lambda x: True, **options):
    def evaluate(x, _near):
        return Point(x, value(x), gradient(x), None) if inside(x) else None

    return fletcher_reeves(evaluate, evaluate(np.array(start, dtype=float), None), **options)


@given(seed=st.integers(0, 10_000), n=st.integers(1, 4), spread=st.floats(0.0, 2.0))
@settings(deadline=None)
def test_quadratics_are_solved(seed, n, spread):
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(n, n)))
    hessian = turn @ np.diag(10.0 ** rng.uniform(-spread / 2, spread / 2, n)) @ turn.T
    goal = rng.uniform(-1.0, 1.0, n)
    descent = _descend(
        lambda x: float((x - goal) @ hessian @ (x - goal)), lambda x: 2.0 * hessian @ (x - goal), np.zeros(n)
    )
    assert descent.converged
    assert descent.point.x == pytest.approx(goal, abs=1e-3)


def test_rosenbrock_is_solved():
    def value(x):
        return float((1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2)

    def gradient(x):
        bend = x[1] - x[0] ** 2
        return np.array([-2 * (1 - x[0]) - 400 * x[0] * bend, 200 * bend])

    descent = _descend(value, gradient, [-1.2, 1.0], settings=DescentSettings(iterations=2000, progress=1e-14))
    assert descent.point.x == pytest.approx([1.0, 1.0], abs=1e-3)


def test_the_domain_is_never_left_and_the_value_never_rises():
    seen = []

    def value(x):
        return float(x @ x)

    def inside(x):
        seen.append(x)
        return x[0] > 0.5  # the minimum lies behind a wall

    descent = _descend(value, lambda x: 2.0 * x, [2.0, 1.0], inside)
    assert descent.point.x[0] > 0.5
    assert descent.point.value < 5.0
    assert any(x[0] <= 0.5 for x in seen)


def test_it_stops_where_it_is_told_to():
    descent = _descend(lambda x: float(x @ x), lambda x: 2.0 * x, [9.0], stop=lambda point: point.value < 30.0)
    assert 1.0 < descent.point.value < 30.0


def test_a_stationary_start_needs_no_search():
    descent = _descend(lambda x: float(x @ x), lambda x: 2.0 * x, [0.0, 0.0])
    assert (descent.converged, descent.iterations, descent.evaluations) == (True, 0, 0)
