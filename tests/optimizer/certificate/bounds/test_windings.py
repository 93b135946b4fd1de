from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.optimizer.certificate.bounds.ball import ANYTHING, Ball
from duocell.optimizer.certificate.bounds.windings import cheapest_windings

TURN = 2.0 * np.pi
WINDINGS = TURN * np.array(list(product(range(-4, 5), repeat=4)))


def brute(values: Floats, lower: float, upper: float, reference: float, max_step: float) -> float:
    """Least cost of exact values (m,) over all windings."""
    paths = values + WINDINGS
    inside = np.all((paths >= lower) & (paths <= upper), axis=1)
    inside &= np.all(np.abs(np.diff(paths, axis=1)) <= max_step, axis=1)
    return float(np.min(np.sum((paths - reference) ** 2, axis=1), where=inside, initial=np.inf))


@pytest.mark.parametrize("max_step", [0.8, np.pi / 2, np.pi, np.inf])
def test_exact_values_cost_what_the_best_lifts_cost(max_step: float) -> None:
    rng = np.random.default_rng(int(10 * min(max_step, 5.0)))
    possible = 0
    for _ in range(40):
        lower, upper = np.sort(rng.uniform(-7.0, 7.0, 2))
        reference = rng.uniform(-4.0, 4.0)
        path = np.cumsum(rng.normal(size=4) * 0.8)
        values = path - TURN * np.round(rng.normal(size=4))
        found = cheapest_windings(Ball(values[None], np.zeros((1, 4))), lower, upper, reference, max_step)
        expected = brute(values, lower, upper, reference, max_step)
        assert found.cost[0] == pytest.approx(expected, rel=1e-12)
        possible += np.isfinite(expected)
        if np.isinf(expected):
            assert np.any(np.isinf(found.each)) or np.any(found.apart)
    assert 5 < possible < 40


def test_intervals_never_cost_more_than_their_members() -> None:
    rng = np.random.default_rng(3)
    checked = 0
    for _ in range(120):
        lower, upper = np.sort(rng.uniform(-8.0, 8.0, 2))
        reference, max_step = rng.uniform(-4.0, 4.0), rng.choice([0.8, np.pi / 2, np.pi])
        centre = np.cumsum(rng.normal(size=4) * 0.6)
        radius = rng.choice([1e-3, 0.1, 0.5, 2.0, ANYTHING], size=4, p=[0.3, 0.3, 0.2, 0.1, 0.1])
        found = cheapest_windings(Ball(centre[None], radius[None]), lower, upper, reference, max_step)
        for _ in range(4):
            inside = centre + np.minimum(radius, np.pi) * rng.uniform(-1.0, 1.0, 4)
            cost = brute(inside, lower, upper, reference, max_step)
            assert found.cost[0] <= cost + 1e-9
            checked += np.isfinite(cost)
    assert checked > 60


def test_endless_and_very_wide_joints_are_never_ruled_out() -> None:
    values = Ball(np.array([[0.2, 9.0, -4.0]]), np.full((1, 3), 0.01))
    for lower, upper in ((-np.inf, np.inf), (-30.0, 30.0)):
        found = cheapest_windings(values, lower, upper, 0.0, np.pi)
        near = np.abs(np.array([0.2, 9.0 - TURN, TURN - 4.0])) - 0.01
        assert found.cost[0] == pytest.approx(np.sum(near**2))


def test_it_says_which_poses_are_outside_and_which_are_apart() -> None:
    outside = cheapest_windings(Ball(np.array([[0.0, 2.0, 0.1]]), np.full((1, 3), 0.1)), -1.0, 1.0, 0.0, np.pi)
    assert np.isinf(outside.cost[0])
    assert np.isinf(outside.each[0]).tolist() == [False, True, False]
    torn = cheapest_windings(Ball(np.array([[0.0, 0.1, 1.8]]), np.full((1, 3), 0.1)), -3.0, 3.0, 0.0, 1.0)
    assert np.isinf(torn.cost[0])
    assert torn.apart[0].tolist() == [False, True, True]
