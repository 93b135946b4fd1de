"""Two arms on one stand: rows against composed transforms, and what is refused."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import rotation_about, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Rigid
from duocell.models.cell.coupling.relations import Bearing, Linear, Separation, Yaws
from duocell.models.cell.task import Task
from duocell.models.robot.arm import Interval
from tests.models.cell.coupling.test_coupling import ANGLE, BASE, LENGTH, Base, worst
from tests.support.given.arms import make_arm

WIDTH = st.sampled_from([0.0, 0.3])


def from_first(first: Base, x: float, y: float, z: float, yaw: float) -> Base:
    """The base that has a pose in the frame of another, by matrices."""
    frame = transform(rotation_z(first[3]), first[:3]) @ transform(rotation_z(yaw), [x, y, z])
    place = frame[:3, 3]
    return float(place[0]), float(place[1]), float(place[2]), float(np.arctan2(frame[1, 0], frame[0, 0]))


def about(value: float, width: float) -> Interval:
    return Interval(value - 0.4 * width, value + 0.6 * width)


@given(BASE, LENGTH, LENGTH, LENGTH, ANGLE, st.tuples(WIDTH, WIDTH, WIDTH, WIDTH))
def test_a_base_with_the_pose_keeps_every_row_and_every_relation(
    first: Base, x: float, y: float, z: float, yaw: float, widths: tuple[float, ...]
) -> None:
    sides = [about(value, width) for value, width in zip((x, y, z, yaw), widths, strict=True)]
    rigid, second = Rigid((0, 1), *sides), from_first(first, x, y, z, yaw)
    if np.hypot(x, y) > 1e-3:
        assert worst(rigid, [first, second]) < 1e-6
    apart = np.subtract(second[:3], first[:3])
    for relation in rigid.relations():
        match relation:
            case Linear():
                value = sum(np.dot((first, second)[arm][:3], way) for arm, way in relation.terms)
                assert relation.low - 1e-9 <= value <= relation.high + 1e-9
            case Separation():
                size = float(np.linalg.norm(apart[:2] if relation.level else apart))
                assert relation.minimum - 1e-9 <= size <= relation.maximum + 1e-9
            case Bearing(axis=int(axis)):
                seen = np.arctan2(apart[1], apart[0]) - (first, second)[axis][3]
                middle, half = 0.5 * (relation.low + relation.high), 0.5 * (relation.high - relation.low)
                assert np.hypot(x, y) < 1e-6 or abs(np.angle(np.exp(1j * (seen - middle)))) <= half + 1e-6
            case Yaws(sense=-1):
                off = second[3] - first[3] - 0.5 * (relation.low + relation.high)
                assert abs(np.angle(np.exp(1j * off))) <= 0.5 * (relation.high - relation.low) + 1e-9


@given(BASE, st.floats(0.2, 2.0), ANGLE, ANGLE)
def test_what_is_off_is_off_by_as_much(first: Base, far: float, heading: float, yaw: float) -> None:
    x, y = far * np.cos(heading), far * np.sin(heading)
    given_sides = [Interval(value, value) for value in (x, y, 0.2, yaw)]
    rigid, second = Rigid((0, 1), *given_sides), from_first(first, x, y, 0.2, yaw)
    assert worst(rigid, [first, (*second[:3], second[3] + 0.3)]) == pytest.approx(0.3, abs=1e-6)
    assert worst(rigid, [(*first[:3], first[3] - 0.3), second]) == pytest.approx(0.3, abs=1e-6)
    assert worst(rigid, [first, (second[0], second[1], second[2] + 0.1, second[3])]) == pytest.approx(0.1, abs=1e-6)
    farther = from_first(first, 1.5 * x, 1.5 * y, 0.2, yaw)
    assert worst(rigid, [first, farther]) == pytest.approx(0.5 * far, abs=1e-6)


def test_one_base_above_the_other_and_any_yaw() -> None:
    above = Rigid((0, 1), Interval(0.0, 0.0), Interval(0.0, 0.0), Interval(0.5, 0.9), Interval(-pi, pi))
    assert worst(above, [(1.0, 2.0, 0.0, 0.3), (1.0, 2.0, 0.7, 2.3)]) < 1e-9
    assert worst(above, [(1.0, 2.0, 0.0, 0.3), (1.1, 2.0, 0.7, 2.3)]) == pytest.approx(0.1)


def test_a_looser_one_keeps_what_the_other_kept_and_more() -> None:
    rigid = Rigid((0, 1), Interval(0.5, 0.5), Interval(0.0, 0.1))
    first, second = (0.0, 0.0, 0.0, 0.0), (0.58, 0.18, 0.05, 0.0)
    assert worst(rigid, [first, second]) > 0.05
    assert worst(rigid.loosened(0.1), [first, second]) < 1e-9


def test_empty_boxes_and_bases_that_are_not_upright_are_refused() -> None:
    with pytest.raises(InvalidInput) as caught:
        Rigid((0, 1), Interval(1.0, 0.0), Interval(0.0, 0.0))
    assert caught.value.pointer == "/x"
    task = Task(np.tile(np.eye(4), (2, 1, 1)))
    hanging = rotation_about(np.array([1.0, 0.0, 0.0]), pi)
    arms = make_arm("ur5e", "one"), make_arm("ur5e", "two", mount=hanging)
    with pytest.raises(InvalidInput, match="'two' has a mount") as caught:
        Cell(task, arms, couplings=(Rigid((0, 1), Interval(1.0, 1.0), Interval(0.0, 0.0)),))
    assert caught.value.pointer == "/coupling/0/arms/1"
