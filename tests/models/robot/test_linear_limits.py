"""Linear limits between joints: what they are, and what is no such limit."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.errors import InvalidRobot
from duocell.models.robot.linear_limits import LinearLimits, row_name, sums_between
from tests.support.given.arms import make_arm

ROW = [0.0, 1.0, 1.0, 0.0, 0.0, 0.0]


def limits(*rows: tuple[list[float], float, float]) -> LinearLimits:
    matrix, lower, upper = zip(*rows, strict=True)
    names = tuple(f"row {k}" for k in range(len(rows)))
    return LinearLimits(names, np.array(matrix), np.array(lower), np.array(upper))


def test_what_has_limits_are_the_joints_and_then_the_sums() -> None:
    sums = limits((ROW, -1.0, 2.0), ([1.0, 0.0, -0.5, 0.0, 0.0, 0.0], 0.0, 1.0))
    arm = make_arm("irb120", linear_limits=sums)
    q = np.array([[0.1, 0.9, 1.2, 0.0, 0.0, 0.0], [0.4, -0.9, -0.6, 0.0, 0.0, 0.0]])
    np.testing.assert_allclose(arm.bounded(q)[:, 6:], [[2.1, -0.5], [-1.5, 0.7]])
    np.testing.assert_allclose(arm.limit_excess(q)[:, 6:], [[0.1, 0.5], [0.5, -0.3]])
    np.testing.assert_allclose(arm.bounded_sizes(np.array([0.1, 0.1, 0.2, 0.0, 0.0, 0.0]))[6:], [0.3, 0.2])
    assert arm.bounded_names == (*arm.robot.joint_names, "row 0", "row 1")
    assert make_arm("irb120").bounded(q) is q
    one = sums.without(0)
    assert one is not None
    assert one.names == ("row 1",)
    assert one.without(0) is None


def test_which_turn_a_joint_is_on_matters_only_to_joints_with_a_turn_and_more() -> None:
    wrist = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
    assert not make_arm("irb120", linear_limits=limits((ROW, -1.0, 2.0))).turns_matter
    assert make_arm("irb120", linear_limits=limits((wrist, -1.0, 2.0))).turns_matter
    assert not make_arm("irb120").turns_matter


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (([0.0] * 6, -1.0, 1.0), "every coefficient is 0"),
        ((ROW, 1.0, 1.0), "not 0.0001 rad below"),
        ((ROW, 1.0, -1.0), "not 0.0001 rad below"),
        ((ROW, np.nan, 1.0), "no angles"),
        ((ROW, -1.0, np.inf), "no angles"),
        (([0.0, 1e-3, 1.0, 0.0, 0.0, 0.0], -1.0, 1.0), "between 0.01 and 100"),
        (([0.0, np.nan, 1.0, 0.0, 0.0, 0.0], -1.0, 1.0), "between 0.01 and 100"),
    ],
)
def test_what_is_no_limit(row: tuple[list[float], float, float], words: str) -> None:
    with pytest.raises(InvalidRobot, match=words):
        limits(row)


def test_narrower_limits_never_cross() -> None:
    narrow = limits((ROW, 0.0, 1.0), (ROW, 0.0, 1e-3)).narrowed(0.01)
    np.testing.assert_allclose(narrow.lower[0], 0.01)
    assert np.all(narrow.upper > narrow.lower)


def test_names_and_ranges_of_sums() -> None:
    assert row_name([0.0, 1.0, -0.5], ["a", "b", "c"]) == "b - 0.5 c"
    assert row_name([-1.0, 2.0, 0.0], ["a", "b", "c"]) == "- a + 2 b"
    low, high = np.array([-1.0, -2.0, -np.inf]), np.array([1.0, 3.0, np.inf])
    assert sums_between(np.array([1.0, -1.0, 0.0]), low, high) == (-4.0, 3.0)
    assert sums_between(np.array([1.0, 0.0, -1.0]), low, high) == (-np.inf, np.inf)
