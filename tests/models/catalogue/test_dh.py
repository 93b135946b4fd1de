"""Robots from D-H tables."""

from __future__ import annotations

from dataclasses import replace
from math import cos, inf, nan, pi, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRobot
from duocell.models.catalogue.dh import DhRow, robot_from_dh
from duocell.models.kinematics.kinematics import flange_poses

ELBOW = [
    DhRow(-pi / 2, 0.0, 0.4, -3.0, 3.0),
    DhRow(0.0, 0.5, 0.0, -2.0, 2.0),
    DhRow(-pi / 2, 0.05, 0.0, -2.0, 2.0),
    DhRow(pi / 2, 0.0, 0.4, -3.0, 3.0),
    DhRow(-pi / 2, 0.0, 0.0, -2.0, 2.0),
    DhRow(0.0, 0.0, 0.1, -6.0, 6.0, theta_offset=pi),
]
LENGTHS = st.floats(-1.0, 1.0)
ANGLES = st.floats(-pi, pi)
ROWS = st.builds(DhRow, ANGLES, LENGTHS, LENGTHS, st.just(-1.0), st.just(2.0), ANGLES)


def link(row: DhRow, q: float) -> Floats:
    """The matrix of a D-H link as printed in textbooks."""
    c, s, ca, sa = cos(q + row.theta_offset), sin(q + row.theta_offset), cos(row.alpha), sin(row.alpha)
    return np.array(
        [[c, -s * ca, s * sa, row.a * c], [s, c * ca, -c * sa, row.a * s], [0, sa, ca, row.d], [0, 0, 0, 1]]
    )


@settings(max_examples=50)
@given(st.lists(ROWS, min_size=6, max_size=7), st.integers(0, 2**32 - 1))
def test_flange_is_the_product_of_the_printed_matrices(rows: list[DhRow], seed: int) -> None:
    try:
        robot = robot_from_dh("arm", rows)
    except InvalidRobot as error:
        assume("singular" not in error.detail)
        raise
    q = np.random.default_rng(seed).uniform(-4.0, 4.0, len(rows))
    expected = np.linalg.multi_dot([link(row, value) for row, value in zip(rows, q, strict=True)])
    assert np.abs(flange_poses(robot, q)[0] - expected).max() < 1e-12


def test_limits_and_mid_range_come_from_the_table() -> None:
    robot = robot_from_dh("elbow", ELBOW)
    assert robot.name == "elbow"
    assert robot.dof == 6
    assert robot.lower.tolist() == [row.lower for row in ELBOW]
    assert robot.upper.tolist() == [row.upper for row in ELBOW]
    assert robot.reference.tolist() == [0.0] * 6
    assert robot.reference_source == "mid-range"


@pytest.mark.parametrize(
    ("joint", "change", "pointer"),
    [
        (2, {"lower": 2.5}, "/dh/2/lower"),
        (0, {"lower": 3.0}, "/dh/0/lower"),
        (1, {"a": 431.8}, "/dh/1/a"),
        (3, {"d": nan}, "/dh/3/d"),
        (4, {"alpha": -90.0}, "/dh/4/alpha"),
        (5, {"upper": inf}, "/dh/5/upper"),
        (5, {"lower": -266.0}, "/dh/5/lower"),
        (5, {"theta_offset": -inf}, "/dh/5/theta_offset"),
    ],
)
def test_faults_are_pointed_at(joint: int, change: dict[str, float], pointer: str) -> None:
    rows = [replace(row, **change) if i == joint else row for i, row in enumerate(ELBOW)]
    with pytest.raises(InvalidRobot) as caught:
        robot_from_dh("arm", rows)
    assert caught.value.pointer == pointer
    assert f"joint {joint + 1}" in caught.value.detail


@pytest.mark.parametrize("count", [0, 1, 5, 8])
def test_other_numbers_of_joints_are_refused_with_what_is_allowed(count: int) -> None:
    with pytest.raises(InvalidRobot, match="6 or 7") as caught:
        robot_from_dh("arm", (ELBOW * 2)[:count])
    assert caught.value.pointer == "/dh"


@pytest.mark.parametrize(
    "rows",
    [
        [DhRow(0.0, 0.0, 0.0, -1.0, 1.0)] * 6,
        [DhRow(0.0, 0.3, 0.1, -1.0, 1.0)] * 6,  # all axes parallel
        [DhRow(pi / 2, 0.0, 0.0, -1.0, 1.0)] * 7,  # all axes meet
        [*ELBOW[1:5], DhRow(0.0, 0.0, 0.4, -1.0, 1.0), DhRow(0.0, 0.0, 0.0, -1.0, 1.0)],  # the last axis twice
    ],
)
def test_geometry_that_is_singular_everywhere_is_refused(rows: list[DhRow]) -> None:
    with pytest.raises(InvalidRobot, match="singular in every posture"):
        robot_from_dh("arm", rows)
