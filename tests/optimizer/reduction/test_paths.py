"""Unwrapping, windings and yaw against brute force over all 2π multiples and all yaws."""

from __future__ import annotations

from math import inf, pi

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.robot.arm import FREE_YAW, BaseRegion
from duocell.optimizer.reduction.paths import choose_windings, choose_yaw, unwrap
from tests.support.angles import TURN, wrapped
from tests.support.given.arms import region

TURNS = TURN * np.arange(-12, 13)
PATHS = st.lists(st.floats(-8.0, 8.0), min_size=1, max_size=6)


@st.composite
def limits(draw: st.DrawFn) -> tuple[float, float]:
    """Lower and upper limit; ranges from a sliver to three turns, or none at all."""
    if draw(st.booleans()) and draw(st.booleans()):
        return -inf, inf
    low = draw(st.floats(-8.0, 6.0))
    return low, low + draw(st.one_of(st.floats(0.05, 3.0 * TURN), st.sampled_from([TURN, 2.0 * TURN, pi])))


def outside(paths: Floats, low: float, high: float) -> Floats:
    """What (..., m) sticks out of the limits at both ends together."""
    beyond: Floats = np.maximum(low - paths.min(axis=-1), 0.0) + np.maximum(paths.max(axis=-1) - high, 0.0)
    return beyond


def cost(paths: Floats, reference: float) -> Floats:
    total: Floats = np.sum((paths - reference) ** 2, axis=-1)
    return total


@given(st.lists(st.floats(-40.0, 40.0), min_size=1, max_size=8))
def test_unwrapped_paths_take_every_step_the_short_way(values: list[float]) -> None:
    original = np.array(values)
    path, step = unwrap(original.copy())
    assert path[0] == original[0]
    assert np.abs(wrapped(path - original)).max() < 1e-12
    steps = np.abs(np.diff(path))
    assert np.all(steps <= pi + 1e-12)
    assert step == pytest.approx(np.max(steps, initial=0.0), abs=1e-12)
    shortest = np.abs(wrapped(np.diff(original)))
    assert steps == pytest.approx(shortest, abs=1e-12)


def test_unwrapping_works_in_place_on_any_number_of_axes() -> None:
    joints = np.random.default_rng(0).uniform(-9.0, 9.0, (2, 3, 4, 5))
    alone = joints.copy()
    path, step = unwrap(joints)
    assert path is joints
    assert step.shape == (2, 3, 4)
    for index in np.ndindex(2, 3, 4):
        expected, length = unwrap(alone[index].copy())
        assert np.array_equal(path[index], expected)
        assert step[index] == length


@given(PATHS, limits(), st.floats(-8.0, 8.0))
@example([0.0, 0.0], (-pi, pi), pi)
@example([3.0, 4.0], (-3.5, -2.0), 0.0)
@example([0.0, 5.0], (-1.0, 1.0), 0.0)
def test_lift_is_the_best_of_all_turns(values: list[float], bounds: tuple[float, float], reference: float) -> None:
    low, high = bounds
    original = np.array(values)
    path = original.copy()
    beyond = choose_windings(path, low, high, reference)
    every = original + TURNS[:, None]
    least = outside(every, low, high).min()
    shift = path - original
    assert shift == pytest.approx(np.full(len(values), shift[0]), abs=1e-9)
    assert abs(wrapped(shift[0])) < 1e-9
    assert beyond == pytest.approx(outside(path, low, high), abs=1e-9)
    assert beyond <= least + 1e-9
    if least == 0.0:
        allowed = every[outside(every, low, high) == 0.0]
        assert cost(path, reference) <= cost(allowed, reference).min() * (1.0 + 1e-9) + 1e-6


def test_lifts_are_chosen_path_by_path() -> None:
    paths = np.array([[[0.0, 0.1]], [[7.0, 7.1]]])
    beyond = choose_windings(paths, -1.0, 1.0, 0.0)
    assert paths == pytest.approx(np.array([[[0.0, 0.1]], [[7.0 - TURN, 7.1 - TURN]]]))
    assert beyond.tolist() == [[0.0], [0.0]]


@st.composite
def yaws(draw: st.DrawFn) -> BaseRegion:
    """Allowed yaw: free, fixed, narrow, wide."""
    low = draw(st.floats(-7.0, 7.0))
    width = draw(st.one_of(st.sampled_from([0.0, TURN, 1e-3, 3.0]), st.floats(0.0, TURN - 1e-3)))
    return region(yaw=FREE_YAW if draw(st.booleans()) else (low, low + width))


@given(PATHS, limits(), st.floats(-8.0, 8.0), yaws(), st.sampled_from([1, -1]))
@example([0.0], (-1.0, 1.0), 0.0, region(yaw=(pi, pi)), 1)
@example([0.3, 0.2], (-1.0, 1.0), 0.5, region(yaw=(-0.4, -0.4)), -1)
@example([0.0, 1.0], (-0.2, 0.2), 0.0, region(yaw=(2.0, 2.1)), 1)
def test_yaw_is_the_best_of_all(
    values: list[float], bounds: tuple[float, float], reference: float, place: BaseRegion, sigma: int
) -> None:
    low, high = bounds
    original = np.array(values)
    path = original.copy()
    yaw, beyond = choose_yaw(path, low, high, reference, place, sigma)
    assert place.yaw.low <= yaw <= place.yaw.high
    shift = path - original
    assert shift == pytest.approx(np.full(len(values), shift[0]), abs=1e-9)
    assert abs(wrapped(shift[0] + sigma * float(yaw))) < 1e-9  # a base yaw shifts joint 1 by -σ yaw
    assert beyond == pytest.approx(outside(path, low, high), abs=1e-9)

    width = min(place.yaw.width, TURN)
    tried = place.yaw.low + width * np.linspace(0.0, 1.0, 721 if width else 1)
    every = original + (-sigma * tried[:, None] + TURNS).ravel()[:, None]
    out = outside(every, low, high)
    assert beyond <= out.min() + 1e-9
    if out.min() == 0.0:
        assert cost(path, reference) <= cost(every[out == 0.0], reference).min() * (1.0 + 1e-9) + 1e-9


@given(PATHS, st.floats(-8.0, 8.0))
def test_a_free_yaw_and_an_endless_joint_put_the_mean_on_the_reference(values: list[float], reference: float) -> None:
    path = np.array(values)
    _, beyond = choose_yaw(path, -inf, inf, reference, region(yaw=FREE_YAW), 1)
    assert np.mean(path) == pytest.approx(reference, abs=1e-9)
    assert beyond == 0.0


def test_yaws_are_chosen_path_by_path() -> None:
    paths = np.random.default_rng(1).uniform(-3.0, 3.0, (4, 5, 6))
    place, alone = region(yaw=(0.3, 0.9)), paths.copy()
    yaw, beyond = choose_yaw(paths, -2.0, 2.5, 0.1, place, -1)
    for index in np.ndindex(4, 5):
        single_yaw, single_beyond = choose_yaw(alone[index], -2.0, 2.5, 0.1, place, -1)
        assert yaw[index] == single_yaw
        assert beyond[index] == single_beyond
        assert np.array_equal(paths[index], alone[index])
