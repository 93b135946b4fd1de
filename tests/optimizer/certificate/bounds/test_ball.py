from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.optimizer.certificate.bounds.ball import ANYTHING, Ball, bearing, cos_sin, distances, reciprocal, stacked

COUNT = 2000


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def random_ball(rng: np.random.Generator, scale: float = 1.0) -> Ball:
    return Ball(rng.normal(size=COUNT) * scale, 10.0 ** rng.uniform(-6, 1, COUNT))


def member(ball: Ball, rng: np.random.Generator) -> Floats:
    chosen: Floats = ball.centre + ball.radius * rng.choice([-1.0, 1.0, 0.3, -0.7], COUNT)
    return chosen


def assert_inside(values: Floats, ball: Ball) -> None:
    assert np.all(np.abs(values - ball.centre) <= ball.radius + 1e-12 * (1.0 + np.abs(values)))


def test_operations_on_members_stay_inside(rng: np.random.Generator) -> None:
    for _ in range(20):
        a, b = random_ball(rng), random_ball(rng)
        x, y = member(a, rng), member(b, rng)
        for values, ball in (
            (x + y, a + b),
            (x - y, a - b),
            (-x, -a),
            (x * y, a * b),
            (x * 3.0, a * 3.0),
            (x - 2.0, a - 2.0),
            (x * y - x, a * b - a),
        ):
            assert_inside(values, ball)
        assert np.all(np.abs(x) <= a.size + 1e-12)


def test_products_are_no_wider_than_needed_for_small_radii() -> None:
    product = Ball(np.array(2.0), np.array(1e-6)) * Ball(np.array(-3.0), np.array(1e-6))
    assert product.centre == -6.0
    assert product.radius == pytest.approx(5e-6, rel=1e-5)


def test_cosine_and_sine(rng: np.random.Generator) -> None:
    for _ in range(20):
        angle = random_ball(rng, 3.0)
        x = member(angle, rng)
        cos, sin = cos_sin(angle)
        assert_inside(np.cos(x), cos)
        assert_inside(np.sin(x), sin)
        small = angle.radius < 1e-3
        assert np.all(cos.radius[small] <= 1.1 * angle.radius[small])
        assert np.all(cos.size <= np.sqrt(2.0) + 1e-12)


def test_reciprocals_of_both_signs(rng: np.random.Generator) -> None:
    low = rng.uniform(0.01, 2.0, COUNT)
    high = low + rng.uniform(0.0, 3.0, COUNT)
    x = low + (high - low) * rng.random(COUNT)
    assert_inside(1.0 / x, reciprocal(low, high))
    assert_inside(-1.0 / x, reciprocal(-high, -low))


def test_bearings_and_distances_of_rectangles(rng: np.random.Generator) -> None:
    x, y = random_ball(rng), random_ball(rng)
    angle, (near, far) = bearing(x, y), distances(x, y)
    for _ in range(50):
        px, py = member(x, rng), member(y, rng)
        away = np.arctan2(py, px) - angle.centre
        away -= 2.0 * np.pi * np.round(away / (2.0 * np.pi))
        assert np.all(np.abs(away) <= angle.radius + 1e-12)
        distance = np.hypot(px, py)
        assert np.all((near - 1e-12 <= distance) & (distance <= far + 1e-12))
    around = (np.abs(x.centre) < x.radius) & (np.abs(y.centre) < y.radius)
    assert np.all(angle.radius[around] == ANYTHING)
    assert np.all(angle.radius[~around] < np.pi)


def test_what_two_balls_share() -> None:
    one, other = (
        Ball.between(np.array([0.0, 0.0]), np.array([2.0, 1.0])),
        Ball(np.array([2.5, 3.0]), np.array([1.0, 0.5])),
    )
    both = one.meet(other)
    assert both.low[0] == pytest.approx(1.5)
    assert both.high[0] == pytest.approx(2.0)
    assert both.radius[1] == 0.0  # nothing in common: a point between them
    assert 1.0 <= both.centre[1] <= 2.5


def test_balls_of_different_shapes_are_stacked() -> None:
    whole = stacked([Ball(np.zeros((2, 3)), np.ones((2, 3))), Ball(np.ones((2, 3)), np.zeros((2, 1)))])
    assert whole.centre.shape == whole.radius.shape == (2, 2, 3)
