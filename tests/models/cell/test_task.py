"""Lines and arcs have the shape they promise; contradictory data are refused with a pointer."""

from __future__ import annotations

from math import acos, cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidTask
from duocell.models.base.pose import inverse, rotation_about, rotation_angle, rotation_from_rpy, transform
from duocell.models.cell.task import Task, arc_about_normal, arc_through_center, line, task_from_poses

LENGTHS = st.floats(-3.0, 3.0)
POINTS = st.tuples(LENGTHS, LENGTHS, LENGTHS)
ANGLES = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
AXES = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)
COUNTS = st.integers(2, 40)
START = transform(np.eye(3), [1.0, 0.0, 0.5])
END = transform(rotation_about((0.0, 0.0, 1.0), 1.0), [0.0, 1.0, 0.5])
Vector = tuple[float, float, float]


def posed(point: Vector, angles: Vector = (0.0, 0.0, 0.0)) -> Floats:
    return transform(rotation_from_rpy(angles), point)


def steps(task: Task) -> Floats:
    lengths: Floats = np.linalg.norm(np.diff(task.poses[:, :3, 3], axis=0), axis=1)
    return lengths


def turns(task: Task) -> Floats:
    return rotation_angle((inverse(task.poses[:-1]) @ task.poses[1:])[:, :3, :3])


@given(POINTS, ANGLES, POINTS, ANGLES, COUNTS)
def test_line_is_straight_even_and_ends_where_it_should(
    a: Vector,
    u: Vector,
    b: Vector,
    v: Vector,
    count: int,
) -> None:
    start, end = posed(a, u), posed(b, v)
    task = line(start, end, count)
    assert len(task) == count
    assert np.allclose(task.poses[[0, -1]], [start, end], rtol=0.0, atol=1e-12)
    length = float(np.linalg.norm(np.subtract(b, a)))
    assert np.allclose(steps(task), length / (count - 1), rtol=0.0, atol=1e-12)  # even steps adding up: straight
    assert np.allclose(turns(task), rotation_angle(start[:3, :3].T @ end[:3, :3]) / (count - 1), rtol=0.0, atol=1e-9)


def ends_of_arc(center: Vector, axis: Vector, radius: float, angle: float) -> tuple[Floats, Floats, Floats]:
    """From the centre to the start, and the poses at both ends."""
    across = np.cross(axis, [0.3, -0.2, 0.9] if abs(axis[0]) > 0.05 else [1.0, 0.0, 0.0])
    spoke = radius * across / np.linalg.norm(across)
    start = transform(np.eye(3), np.add(center, spoke))
    return spoke, start, transform(np.eye(3), center + rotation_about(axis, angle) @ spoke)


@given(POINTS, AXES, st.floats(0.01, 3.0), st.floats(0.01, 3.1), COUNTS)
def test_arc_about_a_center_stays_on_its_circle(
    center: Vector, axis: Vector, radius: float, angle: float, count: int
) -> None:
    spoke, start, end = ends_of_arc(center, axis, radius, angle)
    task = arc_through_center(start, end, center, count)
    spokes = task.poses[:, :3, 3] - center
    fractions = np.linspace(0.0, 1.0, count)
    assert np.allclose(spokes, rotation_about(axis, angle * fractions) @ spoke, rtol=0.0, atol=1e-9)


@given(POINTS, AXES, st.floats(0.01, 3.0), st.floats(0.02, pi), COUNTS)
def test_arc_about_a_normal_is_counter_clockwise(
    center: Vector, axis: Vector, radius: float, angle: float, count: int
) -> None:
    spoke, start, end = ends_of_arc(center, axis, radius, angle)
    task = arc_about_normal(start, end, radius, axis, count)
    fractions = np.linspace(0.0, 1.0, count)
    expected = center + rotation_about(axis, angle * fractions) @ spoke
    # Near the half circle the angle follows from the radius with the square root of its digits only.
    assert np.allclose(task.poses[:, :3, 3], expected, rtol=0.0, atol=1e-6 if angle > 3.1 else 1e-9)
    assert np.allclose(task.poses[[0, -1]], [start, end], rtol=0.0, atol=1e-12)


def test_both_kinds_of_arc_agree() -> None:
    by_center = arc_through_center(START, END, [0.0, 0.0, 0.5], 9)
    by_normal = arc_about_normal(START, END, 1.0, [0.0, 0.0, 2.0], 9)
    assert np.allclose(by_center.poses, by_normal.poses, rtol=0.0, atol=1e-12)


def test_opposite_normal_bends_the_arc_the_other_way() -> None:
    other = arc_about_normal(START, END, 1.0, [0.0, 0.0, -1.0], 3).poses[1, :3, 3]
    assert np.allclose(other, [1.0 - cos(pi / 4), 1.0 - sin(pi / 4), 0.5], rtol=0.0, atol=1e-12)


def test_orientation_turns_evenly_along_an_arc() -> None:
    task = arc_about_normal(START, END, 1.0, [0.0, 0.0, 1.0], 5)
    assert np.allclose(turns(task), 0.25, rtol=0.0, atol=1e-12)


def test_half_circle_is_allowed_with_radius_and_normal() -> None:
    end = transform(np.eye(3), [-1.0, 0.0, 0.5])
    task = arc_about_normal(START, end, 1.0, [0.0, 0.0, 1.0], 3)
    assert np.allclose(task.poses[1, :3, 3], [0.0, 1.0, 0.5], rtol=0.0, atol=1e-12)


def test_arc_of_a_huge_radius_is_a_line() -> None:
    arc = arc_about_normal(START, END, 1e9, [0.0, 0.0, 1.0], 7)
    assert np.allclose(arc.poses, line(START, END, 7).poses, rtol=0.0, atol=1e-9)


def test_arc_of_the_sources_second_example_turns_the_object() -> None:
    angle = 2.0 * acos(0.8)
    start = transform(np.eye(3), [0.9, 0.0, 0.0])
    end = transform(rotation_about((1.0, 0.0, 0.0), -pi / 2), [0.9 * cos(angle), 0.9 * sin(angle), 0.0])
    task = arc_through_center(start, end, [0.0, 0.0, 0.0], 10)
    assert np.allclose(np.linalg.norm(task.poses[:, :3, 3], axis=1), 0.9, rtol=0.0, atol=1e-12)
    assert np.allclose(turns(task), pi / 18, rtol=0.0, atol=1e-12)


def test_poses_of_a_task_are_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        line(START, END, 3).poses[0, 0, 3] = 1.0


OPPOSITE = transform(rotation_about((1.0, 0.0, 0.0), pi), [0.0, 1.0, 0.5])
ABOVE = transform(np.eye(3), [0.0, 1.0, 0.6])
ACROSS = transform(np.eye(3), [-1.0, 0.0, 0.5])
NOWHERE = transform(np.eye(3), [np.inf, 0.0, 0.0])
FAR = transform(np.eye(3), [0.0, -1e308, 0.0])
CENTER = [0.0, 0.0, 0.5]
UP = [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("pointer", "words", "make"),
    [
        ("/count", "at least 2", lambda: line(START, END, 1)),
        ("/count", "at least 2", lambda: arc_through_center(START, END, CENTER, 0)),
        ("/count", "at least 2", lambda: arc_about_normal(START, END, 1.0, UP, -3)),
        ("/end/orientation", "180°", lambda: line(START, OPPOSITE, 5)),
        ("/end/orientation", "180°", lambda: arc_through_center(START, OPPOSITE, CENTER, 5)),
        ("/end", "finite", lambda: line(START, NOWHERE, 5)),
        ("/center", "must agree", lambda: arc_through_center(START, END, [0.0, 1e-4, 0.5], 5)),
        ("/center", "opposite sides", lambda: arc_through_center(START, ACROSS, CENTER, 5)),
        ("/center", "finite", lambda: arc_through_center(START, END, [0.0, np.nan, 0.5], 5)),
        ("/end/position", "different places", lambda: arc_through_center(START, START, CENTER, 5)),
        ("/end/position", "different places", lambda: arc_about_normal(START, START, 1.0, UP, 5)),
        ("/normal", "out of the plane", lambda: arc_about_normal(START, ABOVE, 1.0, UP, 5)),
        ("/normal", "zero", lambda: arc_about_normal(START, END, 1.0, [0.0, 0.0, 0.0], 5)),
        ("/radius", "too small", lambda: arc_about_normal(START, END, 0.7, UP, 5)),
        ("/radius", "too small", lambda: arc_about_normal(START, END, -1.0, UP, 5)),
        ("/radius", "too small", lambda: arc_about_normal(START, END, np.nan, UP, 5)),
        ("/end/position", "Lengths are metres", lambda: line(START, FAR, 5)),
        ("/start/position", "Lengths are metres", lambda: arc_through_center(FAR, END, CENTER, 5)),
        ("/normal", "Lengths are metres", lambda: arc_about_normal(START, END, 1.0, [0.0, 0.0, 1e200], 5)),
        ("/poses/1/position", "Lengths are metres", lambda: task_from_poses([START, FAR])),
        ("/poses", "at least 2", lambda: task_from_poses([])),
        ("/poses", "at least 2", lambda: task_from_poses([np.eye(4)])),
        ("/poses", "4x4", lambda: task_from_poses(np.zeros((3, 3)))),
        ("/poses/1", "rigid", lambda: task_from_poses([np.eye(4), 2.0 * np.eye(4)])),
        ("/poses/0", "rigid", lambda: task_from_poses([NOWHERE, np.eye(4)])),
        ("/poses/1", "rigid", lambda: task_from_poses([np.eye(4), np.diag([1.0, 1.0, -1.0, 1.0])])),
    ],
)
def test_contradictory_data_are_refused(pointer: str, words: str, make: object) -> None:
    with pytest.raises(InvalidTask, match=words) as caught:
        make()  # type: ignore[operator]
    assert caught.value.pointer == pointer


def test_center_off_by_less_than_a_micrometre_is_accepted() -> None:
    task = arc_through_center(START, END, [4e-7, -4e-7, 0.5], 5)
    assert np.allclose(task.poses[[0, -1]], [START, END], rtol=0.0, atol=1e-12)


def test_poses_sent_one_by_one_make_a_task() -> None:
    assert np.array_equal(task_from_poses([START, END]).poses, [START, END])
