"""Base regions, yaw intervals modulo 2π, and the weights of the objective."""

from __future__ import annotations

from math import inf, pi

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from duocell.models.catalogue.catalogue import robot
from duocell.models.robot.arm import FREE_YAW, Interval, equal_weights, range_weights
from tests.support.angles import TURN, wrapped
from tests.support.given.arms import make_arm, region

ANGLES = st.floats(-50.0, 50.0)
WIDTHS = st.one_of(st.floats(0.0, TURN), st.sampled_from([0.0, TURN, 1e-9, TURN - 1e-12, 0.5, 3.0 * pi]))


@given(ANGLES, WIDTHS, ANGLES)
def test_yaw_is_brought_into_the_interval_wherever_one_of_its_turns_lies_there(
    low: float, width: float, yaw: float
) -> None:
    place = region(yaw=(low, low + width))
    result = place.yaw_in_interval(yaw)
    turns = yaw + TURN * np.arange(-40, 41)
    inside = (turns >= place.yaw.low) & (turns <= place.yaw.high)
    assert place.yaw.low - 1e-12 <= result <= place.yaw.high + 1e-12
    if inside.any():
        assert abs(wrapped(result - yaw)) < 1e-12


@given(ANGLES, st.floats(1e-3, TURN - 1e-3), ANGLES)
def test_yaw_that_is_not_allowed_goes_to_the_nearer_end(low: float, width: float, yaw: float) -> None:
    place = region(yaw=(low, low + width))
    turns = yaw + TURN * np.arange(-40, 41)
    gap = np.maximum(place.yaw.low - turns, turns - place.yaw.high)
    assume(gap.min() > 1e-9)
    ends = np.array([place.yaw.low, place.yaw.high])
    away = np.abs(wrapped(ends - yaw))
    assume(abs(away[0] - away[1]) > 1e-9)
    assert place.yaw_in_interval(yaw) == ends[np.argmin(away)]


@given(ANGLES)
def test_a_whole_turn_allows_every_yaw(yaw: float) -> None:
    place = region(yaw=FREE_YAW)
    assert place.yaw_free
    assert abs(wrapped(place.yaw_in_interval(yaw) - yaw)) < 1e-12
    assert -pi <= place.yaw_in_interval(yaw) <= pi


@pytest.mark.parametrize(("yaw", "free"), [((-3.1416, 3.1416), True), ((0.0, 6.28), False), ((1.0, 1.0), False)])
def test_yaw_is_free_from_a_whole_turn_on(yaw: tuple[float, float], free: bool) -> None:
    assert region(yaw=yaw).yaw_free is free


def test_intervals_know_their_middle_and_ends() -> None:
    interval = Interval(-1.0, 3.0)
    assert (interval.width, interval.middle, interval.fixed) == (4.0, 1.0, False)
    assert -1.0 in interval
    assert 3.0 in interval
    assert 3.0 + 1e-12 not in interval
    assert Interval(2.0, 2.0).fixed


def test_bounds_are_in_the_order_x_y_z_yaw() -> None:
    place = region(x=(1, 2), y=(3, 4), z=5, yaw=(6, 7))
    assert place.bounds.tolist() == [[1, 2], [3, 4], [5, 5], [6, 7]]


@given(st.lists(st.one_of(st.floats(0.01, 20.0), st.just(inf)), min_size=1, max_size=7))
def test_range_weights_follow_the_source(ranges: list[float]) -> None:
    upper = np.array(ranges) / 2.0
    weights = range_weights(-upper, upper)
    finite = [r for r in ranges if r < inf]
    for weight, joint_range in zip(weights, ranges, strict=True):
        expected = (max(finite) / joint_range) ** 2 if joint_range < inf else 0.0  # (8.8)
        assert weight == pytest.approx(expected, rel=1e-12)


def test_range_weights_of_the_source_arm() -> None:
    puma = robot("puma560")
    degrees = np.array([320, 230, 270, 280, 200, 532])
    assert range_weights(puma.lower, puma.upper) == pytest.approx((532 / degrees) ** 2)


def test_a_joint_open_on_one_side_has_no_range() -> None:
    assert range_weights(np.array([-1.0, -inf]), np.array([1.0, 2.0])).tolist() == [1.0, 0.0]
    assert equal_weights(np.array([-1.0, -inf]), np.array([1.0, 2.0])).tolist() == [1.0, 0.0]


def test_arrays_of_an_arm_are_copies_and_read_only() -> None:
    tool = np.eye(4)
    arm = make_arm(tool=tool)
    tool[0, 3] = 9.0
    assert arm.tool[0, 3] == 0.0
    for field in (arm.tool, arm.grasp, arm.lower, arm.upper, arm.reference, arm.weights):
        with pytest.raises(ValueError, match="read-only"):
            field[...] = 1.0


def test_arrays_of_the_wrong_shape_are_refused() -> None:
    with pytest.raises(ValueError, match="shape"):
        make_arm(weights=np.ones(7))
