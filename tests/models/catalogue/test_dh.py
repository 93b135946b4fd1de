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
from duocell.models.base.pose import rotation_from_rpy, rotation_x, rotation_z, transform
from duocell.models.catalogue.dh import DhRow, robot_from_dh
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.joint import JointKind

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
    rows: list[DhRow] = [replace(row, **change) if i == joint else row for i, row in enumerate(ELBOW)]  # type: ignore[arg-type]
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


def test_a_linear_axis_adds_its_value_to_d() -> None:
    """Against the product of the table's four motions, with the first frame anywhere."""
    start = transform(rotation_from_rpy((0.1, 1.5, -0.4)), [0.2, 0.1, 0.25])
    axis = DhRow(alpha=0.5, a=0.1, d=0.2, lower=-1.0, upper=2.0, theta_offset=0.3, kind=JointKind.PRISMATIC)
    robot = robot_from_dh("arm", [axis, *ELBOW], start)
    assert robot.joint_kinds[0] is JointKind.PRISMATIC
    assert robot.lower[0] == -1.0
    assert robot.upper[0] == 2.0
    q = np.array([0.7, 0.3, -0.8, 1.2, 0.4, -0.9, 0.5])
    expected = start.copy()
    for row, value in zip([axis, *ELBOW], q, strict=True):
        shifts = row.kind is JointKind.PRISMATIC
        turn = row.theta_offset + (0.0 if shifts else value)
        expected = expected @ transform(rotation_z(turn), [0.0, 0.0, row.d + (value if shifts else 0.0)])
        expected = expected @ transform(rotation_x(row.alpha), [row.a, 0.0, 0.0])
    assert np.allclose(flange_poses(robot, q)[0], expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("joint", "change", "pointer", "words"),
    [
        (2, {}, "/dh/2/type", "only the first joint"),
        (0, {"upper": 2000.0}, "/dh/0/upper", "-100 to 100 m"),
        (0, {"lower": 1.0, "upper": 1.0}, "/dh/0/lower", "1 m of joint 1"),
    ],
)
def test_faults_of_linear_axes_are_told_in_metres(
    joint: int, change: dict[str, float], pointer: str, words: str
) -> None:
    rows: list[DhRow] = list(ELBOW)
    rows[joint] = replace(rows[joint], kind=JointKind.PRISMATIC, **change)
    with pytest.raises(InvalidRobot, match=words) as caught:
        robot_from_dh("arm", rows)
    assert caught.value.pointer == pointer
