"""Poses and every rotation format of the contract, against definitions and scipy."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from duocell.models.base import pose
from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRotation

ANGLES = st.floats(-7.0, 7.0)
TRIPLES = st.tuples(ANGLES, ANGLES, ANGLES)
UNITS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def rotation(angles: tuple[float, float, float]) -> Floats:
    return pose.rotation_from_rpy(angles)


def close(a: Floats, b: Floats, tolerance: float = 1e-12) -> bool:
    return bool(np.allclose(a, b, rtol=0.0, atol=tolerance))


@given(TRIPLES, st.tuples(ANGLES, ANGLES, ANGLES))
def test_inverse_undoes_a_transform(angles: tuple[float, float, float], position: tuple[float, float, float]) -> None:
    there = pose.transform(rotation(angles), position)
    assert close(pose.inverse(there) @ there, np.eye(4))
    assert close(there @ pose.inverse(there), np.eye(4))


def test_transform_and_inverse_work_on_stacks_and_broadcast() -> None:
    rotations = pose.rotation_z(np.linspace(0.0, 3.0, 6).reshape(2, 3))
    stack = pose.transform(rotations, [1.0, 2.0, 3.0])
    assert stack.shape == (2, 3, 4, 4)
    for i, j in np.ndindex(2, 3):
        assert close(pose.inverse(stack)[i, j] @ stack[i, j], np.eye(4))


@given(TRIPLES)
def test_rpy_is_yaw_pitch_roll_about_fixed_axes(angles: tuple[float, float, float]) -> None:
    assert close(pose.rotation_from_rpy(angles), Rotation.from_euler("xyz", angles).as_matrix())


@given(TRIPLES)
def test_euler_zyz_is_about_moving_axes(angles: tuple[float, float, float]) -> None:
    assert close(pose.rotation_from_euler_zyz(angles), Rotation.from_euler("ZYZ", angles).as_matrix())


@given(TRIPLES)
def test_axis_angle_is_a_rotation_vector(vector: tuple[float, float, float]) -> None:
    assert close(pose.rotation_from_axis_angle(vector), Rotation.from_rotvec(vector).as_matrix())
    tiny = 1e-160 * np.array(vector)
    assert close(pose.rotation_from_axis_angle(tiny), np.eye(3))


@given(TRIPLES)
def test_the_angles_of_kuka_and_fanuc_are_in_degrees(angles: tuple[float, float, float]) -> None:
    degrees = 50.0 * np.array(angles)
    assert close(pose.rotation_from_abc_deg(degrees), Rotation.from_euler("ZYX", degrees, degrees=True).as_matrix())
    assert close(pose.rotation_from_wpr_deg(degrees), Rotation.from_euler("xyz", degrees, degrees=True).as_matrix())


@given(TRIPLES)
def test_fanuc_angles_are_the_quaternion_that_a_maker_of_cameras_publishes(
    angles: tuple[float, float, float],
) -> None:
    # "FANUC XYZ-WPR format" in the manual of the rc_visard, Roboception.
    w, p, r = 25.0 * np.array(angles)
    (cw, cp, cr), (sw, sp, sr) = np.cos(np.radians([w, p, r]) / 2), np.sin(np.radians([w, p, r]) / 2)
    quaternion = [
        cr * cp * sw - sr * sp * cw,
        cr * sp * cw + sr * cp * sw,
        sr * cp * cw - cr * sp * sw,
        cr * cp * cw + sr * sp * sw,
    ]
    assert close(pose.rotation_from_wpr_deg([w, p, r]), pose.rotation_from_quaternion(quaternion))


@given(TRIPLES)
def test_kuka_angles_come_back_by_the_formulas_of_the_controller(angles: tuple[float, float, float]) -> None:
    # MAT_TO_ROT of KUKA's own library: A = atan2(t21, t11), C from t3x and the other columns.
    t = pose.rotation_from_abc_deg(20.0 * np.array(angles))
    a = np.arctan2(t[1, 0], t[0, 0])
    b = np.arctan2(-t[2, 0], np.hypot(t[0, 0], t[1, 0]))
    c = np.arctan2(np.sin(a) * t[0, 2] - np.cos(a) * t[1, 2], -np.sin(a) * t[0, 1] + np.cos(a) * t[1, 1])
    assume(np.hypot(t[0, 0], t[1, 0]) > 1e-6)
    assert close(pose.rotation_from_abc_deg(np.degrees([a, b, c])), t, 1e-9)


@pytest.mark.parametrize(
    ("quaternion", "matrix"),
    [  # the two examples of data type `orient` in ABB's RAPID Reference Manual
        ([0.7071068, 0.0, 0.7071068, 0.0], [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
        ([0.965926, 0.0, 0.258819, 0.0], [[3**0.5 / 2, 0.0, 0.5], [0.0, 1.0, 0.0], [-0.5, 0.0, 3**0.5 / 2]]),
    ],
)
def test_abb_writes_the_scalar_first(quaternion: list[float], matrix: list[list[float]]) -> None:
    assert close(pose.rotation_from_quaternion_wxyz(quaternion), np.array(matrix), 1e-6)


@given(TRIPLES)
def test_oat_relates_to_euler_zyz_as_the_source_says(angles: tuple[float, float, float]) -> None:
    alpha, beta, gamma = angles
    oat = (pi / 2 + alpha, pi / 2 - beta, gamma)  # (3.34)
    assert close(pose.rotation_from_oat(oat), pose.rotation_from_euler_zyz(angles))


@given(TRIPLES)
def test_quaternion_goes_there_and_back(angles: tuple[float, float, float]) -> None:
    r = rotation(angles)
    q = pose.quaternion_from_rotation(r)
    assert abs(np.linalg.norm(q) - 1.0) < 1e-14
    assert close(pose.rotation_from_quaternion(q), r)


@given(TRIPLES)
def test_quaternion_agrees_with_scipy(angles: tuple[float, float, float]) -> None:
    q = pose.quaternion_from_rotation(rotation(angles))
    theirs = Rotation.from_matrix(rotation(angles)).as_quat()
    assert close(q, theirs, 1e-9) or close(q, -theirs, 1e-9)
    assert q[3] >= -1e-12


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 1), (-1, 0, 0), (-1, 1, 1)])
def test_half_turns_have_one_canonical_quaternion(axis: tuple[int, int, int]) -> None:
    q = pose.quaternion_from_rotation(pose.rotation_about(axis, pi))
    opposite = pose.quaternion_from_rotation(pose.rotation_about(np.negative(axis), pi))
    assert close(q, opposite)
    assert q[np.argmax(np.abs(q) > 1e-9)] > 0.0


def test_quaternions_of_a_stack_are_those_of_its_members() -> None:
    stack = pose.rotation_about((1.0, 2.0, -1.0), np.linspace(-4.0, 4.0, 9))
    together = pose.quaternion_from_rotation(stack)
    assert close(together, np.array([pose.quaternion_from_rotation(r) for r in stack]))


@given(UNITS, st.one_of(st.floats(0.0, pi), st.floats(-12.0, -1.0).map(lambda e: 10.0**e)))
def test_rotation_angle_is_accurate_everywhere(axis: tuple[float, float, float], angle: float) -> None:
    for value in (angle, pi - angle):
        assert abs(float(pose.rotation_angle(pose.rotation_about(axis, value))) - abs(value)) < 5e-15


@given(UNITS, st.floats(0.0, 3.14))
def test_rotation_vector_is_axis_times_angle(axis: tuple[float, float, float], angle: float) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    assert close(pose.rotation_vector(pose.rotation_about(axis, angle)), angle * unit, 1e-11)


def test_rotation_vector_of_no_rotation_is_zero() -> None:
    assert np.array_equal(pose.rotation_vector(np.eye(3)), np.zeros(3))


@given(UNITS, ANGLES)
def test_rotation_about_agrees_with_scipy(axis: tuple[float, float, float], angle: float) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    assert close(pose.rotation_about(axis, angle), Rotation.from_rotvec(angle * unit).as_matrix())


@given(TRIPLES, st.integers(0, 2**32 - 1))
def test_matrix_with_printed_digits_becomes_a_rotation_nearby(angles: tuple[float, float, float], seed: int) -> None:
    r = rotation(angles)
    printed = r + np.random.default_rng(seed).uniform(-2e-4, 2e-4, (3, 3))
    back = pose.rotation_from_matrix(printed)
    assert close(back.T @ back, np.eye(3))
    assert float(pose.rotation_angle(back.T @ r)) < 1e-3


def test_matrix_of_the_source_with_three_digits_is_accepted() -> None:
    rows = np.array([[-1.0, 0.0, 0.0], [0.0, -0.707, -0.707], [0.0, -0.707, 0.707]])
    assert float(pose.rotation_angle(pose.rotation_from_matrix(rows).T @ rows)) < 1e-3


def test_left_handed_matrix_is_named_so() -> None:
    with pytest.raises(InvalidRotation, match="left-handed"):
        pose.rotation_from_matrix([[0, 0, 1], [1, 0, 0], [0, -1, 0]])  # the misprint of the source's T_C^F


@pytest.mark.parametrize(
    "rows",
    [
        np.eye(3) * 1.002,
        np.zeros((3, 3)),
        np.array([[1, 0, 0], [0, 1, 0], [0, 0.01, 1]]),
        np.ones((3, 3)),
    ],
)
def test_matrix_that_is_not_orthonormal_is_refused(rows: Floats) -> None:
    with pytest.raises(InvalidRotation, match="not orthonormal"):
        pose.rotation_from_matrix(rows)


@pytest.mark.parametrize("length", [0.9991, 1.0, 1.0009])
def test_quaternion_of_nearly_unit_length_is_normalised(length: float) -> None:
    q = length * np.array([0.5, -0.5, 0.5, 0.5])
    assert close(pose.rotation_from_quaternion(q), Rotation.from_quat(q).as_matrix())


@pytest.mark.parametrize("length", [0.0, 1e-320, 0.998, 1.002, 2.0, 1e308])
def test_quaternion_of_other_length_is_refused(length: float) -> None:
    with pytest.raises(InvalidRotation, match="length"):
        pose.rotation_from_quaternion([0.0, 0.0, 0.0, length])


@pytest.mark.parametrize(
    ("function", "values"),
    [
        (pose.rotation_from_quaternion, [0.0, 0.0, float("nan"), 1.0]),
        (pose.rotation_from_quaternion, [0.0, 0.0, 1.0]),
        (pose.rotation_from_matrix, [[1.0, 0.0], [0.0, 1.0]]),
        (pose.rotation_from_matrix, [[1.0, 0.0, 0.0], [0.0, 1.0], [0.0, 0.0, 1.0]]),
        (pose.rotation_from_rpy, [0.0, float("inf"), 0.0]),
        (pose.rotation_from_euler_zyz, ["a", "b", "c"]),
        (pose.rotation_from_oat, [0.0, 0.0, 0.0, 0.0]),
    ],
)
def test_values_that_are_no_numbers_of_the_right_shape_are_refused(function: object, values: object) -> None:
    with pytest.raises(InvalidRotation):
        function(values)  # type: ignore[operator]


@given(TRIPLES, UNITS, st.floats(0.0, 3.1), st.floats(0.0, 1.0))
def test_interpolation_turns_evenly_on_the_shortest_way(
    angles: tuple[float, float, float], axis: tuple[float, float, float], angle: float, fraction: float
) -> None:
    start = rotation(angles)
    end = start @ pose.rotation_about(axis, angle)
    way = pose.interpolate_rotations(start, end, [0.0, fraction, 1.0])
    assert close(way[0], start)
    assert close(way[2], end)
    assert abs(float(pose.rotation_angle(start.T @ way[1])) - fraction * angle) < 1e-10
    assert abs(float(pose.rotation_angle(way[1].T @ end)) - (1.0 - fraction) * angle) < 1e-10


@given(TRIPLES, TRIPLES)
def test_interpolation_is_the_same_seen_from_the_other_end(
    first: tuple[float, float, float], last: tuple[float, float, float]
) -> None:
    start, end = rotation(first), rotation(last)
    assume(float(pose.rotation_angle(start.T @ end)) < 3.1)
    forth = pose.interpolate_rotations(start, end, [0.25])[0]
    back = pose.interpolate_rotations(end, start, [0.75])[0]
    assert close(forth, back, 1e-9)


@pytest.mark.parametrize("miss", [0.0, 1e-8, -1e-8])
def test_interpolation_between_opposite_orientations_is_refused(miss: float) -> None:
    with pytest.raises(InvalidRotation, match="180°"):
        pose.interpolate_rotations(np.eye(3), pose.rotation_about((1, 2, 3), pi + miss), [0.5])


@pytest.mark.parametrize("name", ["quaternion", "matrix", "rpy", "euler_zyz", "oat"])
def test_stacks_of_any_shape_are_converted_at_once(name: str) -> None:
    rng = np.random.default_rng(3)
    turns = Rotation.random(12, rng=rng)
    sent = {"quaternion": turns.as_quat(), "matrix": turns.as_matrix()}.get(name, rng.uniform(-4.0, 4.0, (12, 3)))
    convert = getattr(pose, f"rotation_from_{name}")
    single = np.array([convert(one) for one in sent])
    np.testing.assert_array_equal(convert(sent), single)
    np.testing.assert_array_equal(convert(sent.reshape(3, 4, *sent.shape[1:])), single.reshape(3, 4, 3, 3))
    assert convert(sent[:0]).shape == (0, 3, 3)


def test_the_first_wrong_one_of_a_stack_is_told() -> None:
    with pytest.raises(InvalidRotation, match=r"length 1\.5"):
        pose.rotation_from_quaternion([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.5], [0.0, 0.0, 0.0, 3.0]])
