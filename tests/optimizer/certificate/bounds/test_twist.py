from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.certificate.bounds.twist import Twist, twist_cost
from duocell.optimizer.certificate.bounds.yaw import Shifts

TURN = 2.0 * np.pi


def rules(rng: np.random.Generator, endless: bool = False) -> Rules:
    lower, upper = np.sort(rng.uniform(-6.0, 6.0, (2, 6)), axis=0)
    if endless:
        lower[3], upper[3] = -np.inf, np.inf
    weights = rng.uniform(0.0, 2.0, 6) * (rng.random(6) < 0.8)
    one = (slice(0, 1),), np.ones(0, dtype=bool), None  # a segment of one pose
    return Rules(lower, upper, rng.uniform(-3.0, 3.0, 6), weights, np.pi, Shifts(0.0, 0.0, True), *one)


def least(given: Rules, total: float, sense: float) -> float:
    """Least cost of joints 4 and 6 with ``q4 + sense q6 = total`` modulo 2π, by a fine grid."""
    best = np.inf
    ends = np.where(np.isfinite(given.lower), [given.lower, given.upper], [[-9.0], [9.0]])
    for turn in range(-6, 7):
        sixth = np.linspace(ends[0, 5], ends[1, 5], 4001)
        fourth = total + TURN * turn - sense * sixth
        inside = (fourth >= given.lower[3]) & (fourth <= given.upper[3])
        errors = given.weights[3] * (fourth - given.reference[3]) ** 2
        errors += given.weights[5] * (sixth - given.reference[5]) ** 2
        best = min(best, float(np.min(errors, where=inside, initial=np.inf)))
    return best


@pytest.mark.parametrize(("sense", "endless"), [*product((1.0, -1.0), (False, True))])
def test_it_is_the_least_cost_of_the_pair(sense: float, endless: bool) -> None:
    rng = np.random.default_rng(7)
    possible = 0
    for _ in range(60):
        given, total = rules(rng, endless), rng.uniform(-4.0, 4.0)
        exact = Twist(Ball(np.array([[total]]), np.zeros((1, 1))), np.array([[sense]]))
        bound, truth = twist_cost(exact, given)[0, 0], least(given, total, sense)
        assert bound <= truth + 1e-9
        if np.isfinite(truth):
            possible += 1
            # without limits on joint 4 those of joint 6 are left out as well
            assert endless or bound == pytest.approx(truth, rel=0.02, abs=0.02)
        radius = 10.0 ** rng.uniform(-3.0, 0.6)
        around = Twist(Ball(np.array([[total + radius * rng.uniform(-1, 1)]]), np.full((1, 1), radius)), exact.sense)
        assert twist_cost(around, given)[0, 0] <= truth + 1e-9
    assert possible > 20
