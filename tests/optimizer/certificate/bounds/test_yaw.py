from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.optimizer.certificate.bounds.ball import ANYTHING, Ball
from duocell.optimizer.certificate.bounds.yaw import Shifts, shift_cost, torn, unwrapped

TURN = 2.0 * np.pi
FREE = Shifts(0.0, 0.0, True)


def best_shift(path: Floats, lower: float, upper: float, reference: float, shifts: Shifts) -> float:
    """Least cost of a continuous path over the allowed shifts, by a fine grid."""
    wanted = reference - path.mean()
    if shifts.free:
        candidates = np.append(np.linspace(-15.0, 15.0, 6001), wanted)
    else:
        one = np.append(np.linspace(0.0, shifts.width, 400), (wanted - shifts.start) % TURN)
        one = one[one <= shifts.width]
        candidates = (shifts.start + one[:, None] + TURN * np.arange(-4, 5)).ravel()
    moved = path + candidates[:, None]
    inside = np.all((moved >= lower) & (moved <= upper), axis=1)
    costs = np.sum((moved - reference) ** 2, axis=1)
    return float(np.min(costs, where=inside, initial=np.inf))


@pytest.mark.parametrize(
    "shifts", [FREE, Shifts(0.7, 0.0, False), Shifts(-2.0, 1.5, False), Shifts(1.0, 5.5, False)], ids=str
)
def test_no_path_inside_the_intervals_costs_less(shifts: Shifts) -> None:
    rng = np.random.default_rng(17)
    possible, tight = 0, 0
    for _ in range(400):
        max_step = rng.choice([0.8, np.pi / 2, np.pi])
        steps = rng.uniform(-1.0, 1.0, 5) * min(max_step, 2.0)
        path = rng.uniform(-3.0, 3.0) + np.cumsum(steps)
        radius = rng.choice([1e-4, 0.05, 0.4, 1.5, ANYTHING], size=5, p=[0.4, 0.3, 0.15, 0.1, 0.05])
        centre = path + np.minimum(radius, 3.0) * rng.uniform(-1.0, 1.0, 5) + TURN * rng.integers(-1, 2, 5)
        reference = rng.uniform(-2.0, 2.0)
        lower, upper = (-np.inf, np.inf) if rng.random() < 0.3 else np.sort(rng.uniform(-7.0, 7.0, 2))
        values, linked = unwrapped(Ball(centre[None], radius[None]), max_step)
        found = shift_cost(values, linked, lower, upper, reference, shifts)
        cost = best_shift(path, lower, upper, reference, shifts)
        assert found.cost[0] <= cost + 1e-6
        assert not np.any(torn(Ball(centre[None], radius[None]), max_step))
        if np.isfinite(cost):
            possible += 1
            assert not np.any(found.outside)
            tight += bool(np.all(radius < 1e-3) and found.cost[0] > 0.99 * cost)
    assert possible > 50
    assert tight > 0


def test_the_mean_is_not_taken_over_poses_that_may_be_on_different_turns() -> None:
    # Nearly half a turn apart, and not known to within it: the second pose may be on either side of the first.
    centre, radius = np.array([[0.0, 3.0]]), np.array([[0.3, 0.3]])
    values, linked = unwrapped(Ball(centre, radius), np.pi)
    assert not linked[0, 0]
    other_way_round = np.array([0.3, 3.3 - TURN])  # members of both, a step of -3.28 + 2π... below the mean's promise
    shortest = np.array([0.3, 2.7])
    for path in (other_way_round, shortest):
        cost = np.sum((path - path.mean()) ** 2)
        assert shift_cost(values, linked, -np.inf, np.inf, 0.0, FREE).cost[0] <= cost
    known, sure = unwrapped(Ball(centre, radius * 0.1), np.pi)
    assert sure[0, 0]
    assert shift_cost(known, sure, -np.inf, np.inf, 0.0, FREE).cost[0] > 0.9 * 2 * 1.5**2


def test_a_fixed_yaw_tells_which_poses_are_outside() -> None:
    values, linked = unwrapped(Ball(np.array([[0.0, 1.0, 2.0]]), np.full((1, 3), 0.01)), np.pi / 2)
    found = shift_cost(values, linked, -1.5, 1.5, 0.0, Shifts(0.0, 0.0, False))
    assert np.isinf(found.cost[0])
    assert found.outside[0].tolist() == [False, False, True]
    turned = shift_cost(values, linked, -1.5, 1.5, 0.0, Shifts(-1.0, 0.0, False))
    assert turned.cost[0] == pytest.approx(2.0, rel=0.05)


def test_steps_that_no_lift_makes_short_are_torn() -> None:
    values = Ball(np.array([[0.0, 6.4, 8.3]]), np.full((1, 3), 0.1))
    assert torn(values, 1.0)[0].tolist() == [False, False, True]
