"""Ties between bases: rows against the geometry they stand for, on numbers, arrays and expressions."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import rotation_z
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, Rigid, SameHeight, among
from duocell.models.cell.coupling.direction import APART
from duocell.models.robot.arm import Interval

LENGTH = st.floats(-3.0, 3.0)
ANGLE = st.floats(-3.1, 3.1)
BASE = st.tuples(LENGTH, LENGTH, LENGTH, ANGLE)
Base = tuple[float, float, float, float]
"""x, y, z [m] and yaw [rad]."""


def worst(coupling: Coupling, bases: list[Base]) -> float:
    rows = coupling.rows(bases)
    return float(max(max(low - v, v - high) for v, low, high in zip(rows.values, rows.lower, rows.upper, strict=True)))


@given(BASE, LENGTH, LENGTH, ANGLE)
def test_the_mirror_image_keeps_every_row_and_its_x_axis_is_reflected(
    base: Base, x: float, y: float, angle: float
) -> None:
    along = np.array([np.cos(angle), np.sin(angle)])
    reflect = 2.0 * np.outer(along, along) - np.eye(2)
    point = np.array([x, y])
    place = point + reflect @ (np.array(base[:2]) - point)
    axis = reflect @ rotation_z(base[3])[:2, 0]
    image = (*place, base[2], float(np.arctan2(axis[1], axis[0])))
    mirror = Mirror((0, 1), (x, y), angle)
    assert worst(mirror, [base, image]) < 1e-9
    assert worst(mirror, [base, (image[0], image[1], image[2], image[3] + np.pi)]) > 1.9
    assert worst(mirror, [base, (image[0] + 0.1, image[1], image[2], image[3])]) > 0.05


@given(BASE, BASE)
def test_distance_is_that_of_the_plane(first: Base, second: Base) -> None:
    apart = float(np.hypot(second[0] - first[0], second[1] - first[1]))
    assert worst(Distance((0, 1), apart, apart), [first, second]) < 1e-5
    assert worst(Distance((0, 1), apart + 0.5), [first, second]) == pytest.approx(0.5, abs=1e-5)
    assert worst(Distance((0, 1), 0.0, max(apart - 0.1, 0.0)), [first, second]) == pytest.approx(
        apart - max(apart - 0.1, 0.0), abs=1e-5
    )


@given(BASE, ANGLE, st.floats(0.1, 3.0))
def test_direction_holds_on_one_side_only(first: Base, angle: float, far: float) -> None:
    way = far * np.array([np.cos(angle), np.sin(angle)])
    ahead = (first[0] + way[0], first[1] + way[1], 0.3, 0.0)
    behind = (first[0] - way[0], first[1] - way[1], 0.3, 0.0)
    assert worst(Direction((0, 1), angle), [first, ahead]) < 1e-9
    assert worst(Direction((0, 1), angle), [first, behind]) == pytest.approx(far + APART)


@given(LENGTH, LENGTH, ANGLE, st.lists(LENGTH, min_size=3, max_size=3), LENGTH)
def test_bases_on_a_rail_are_on_it_wherever_they_stand(
    x: float, y: float, angle: float, steps: list[float], height: float
) -> None:
    bases = [(x + s * np.cos(angle), y + s * np.sin(angle), height, s) for s in steps]
    assert worst(Rail((0, 1, 2), angle, (x, y)), bases) < 1e-9
    assert worst(Rail((0, 1, 2), angle), bases) < 1e-9
    aside = (bases[2][0] - 0.2 * np.sin(angle), bases[2][1] + 0.2 * np.cos(angle), height, 0.0)
    assert worst(Rail((0, 1, 2), angle), [*bases[:2], aside]) == pytest.approx(0.2)
    shifted = [(b[0] - 0.2 * np.sin(angle), b[1] + 0.2 * np.cos(angle), height, 0.0) for b in bases]
    assert worst(Rail((0, 1, 2), angle), shifted) < 1e-9
    assert worst(Rail((0, 1, 2), angle, (x, y)), shifted) == pytest.approx(0.2)


def test_same_height_is_the_difference_of_neighbours() -> None:
    rows = SameHeight((0, 2)).rows([(0, 0, 0.5, 0), (0, 0, 9.0, 0), (0, 0, 0.8, 0)])
    assert rows.values == pytest.approx((0.3,))


@pytest.mark.parametrize(
    "coupling",
    [
        SameHeight((0, 1)),
        Distance((0, 1), 0.5, 2.0),
        Direction((1, 0), 0.7),
        Mirror((0, 1), (0.2, -0.4), 1.1),
        Rail((0, 1), -0.3, (1.0, 0.0)),
        Rigid((0, 1), Interval(0.8, 0.8), Interval(-0.3, -0.3), yaw=Interval(0.5, 0.5)),
        Rigid((1, 0), Interval(0.8, 0.9), Interval(-0.3, 0.3), yaw=Interval(0.5, 0.9)),
    ],
    ids=lambda coupling: coupling.kind,
)
def test_numbers_arrays_and_expressions_agree(coupling: Coupling) -> None:
    rng = np.random.default_rng(3)
    places = rng.normal(size=(2, 4, 5))
    symbols = [ca.SX.sym(f"base{a}", 4) for a in range(2)]
    expression = coupling.rows([[s[i] for i in range(4)] for s in symbols])
    function = ca.Function("rows", symbols, [ca.vertcat(*expression.values)])
    arrays = coupling.rows([places[0], places[1]])
    assert len(arrays.values) == len(arrays.labels) == len(arrays.lower) == len(arrays.upper)
    for k in range(5):
        numbers = coupling.rows([tuple(places[a, :, k]) for a in range(2)])
        assert np.allclose([value[k] for value in arrays.values], numbers.values)
        assert np.allclose(function(places[0, :, k], places[1, :, k]).full().ravel(), numbers.values)


HERE = (0.3, -0.2, 0.5, 0.4)
SIDE = 0.7
"""rad, direction of the rail and of the mirror's plane, and from the first base to the second."""


def moved(along: float = 0.0, across: float = 0.0, up: float = 0.0, turn: float = 0.0) -> tuple[Base, Base]:
    """A base, and the same base moved and turned, seen along `SIDE`."""
    x = HERE[0] + along * np.cos(SIDE) - across * np.sin(SIDE)
    y = HERE[1] + along * np.sin(SIDE) + across * np.cos(SIDE)
    return HERE, (float(x), float(y), HERE[2] + up, HERE[3] + turn)


MIRROR = Mirror((0, 1), HERE[:2], SIDE)
FACING = 2.0 * (SIDE - HERE[3])
"""rad, from the yaw of `HERE` to that of its mirror image."""


@pytest.mark.parametrize(
    ("coupling", "bases", "label", "excess"),
    [
        (SameHeight((0, 1)), moved(up=0.2), "same height", 0.2),
        (Distance((0, 1), 0.0, 0.5), moved(along=0.8), "distance of the bases", 0.3),
        (Direction((0, 1), SIDE), moved(along=1.0, across=0.1), "direction of the second base", 0.1),
        (Direction((0, 1), SIDE), moved(along=-1.0), "side of the second base", 1.0 + APART),
        (Rail((0, 1), SIDE), moved(along=1.0, across=0.1), "on the rail", 0.1),
        (Rail((0, 1), SIDE), moved(along=1.0, up=0.2), "same height", 0.2),
        (Rail((0, 1), SIDE, HERE[:2]), moved(across=0.1), "on the rail", 0.1),
        (
            MIRROR,
            moved(along=0.1, turn=FACING),
            "mirrored along the plane",
            0.1,
        ),
        (
            MIRROR,
            moved(across=0.1, turn=FACING),
            "mirrored across the plane",
            0.1,
        ),
        (MIRROR, moved(up=0.2, turn=FACING), "same height", 0.2),
        (
            MIRROR,
            moved(turn=FACING + 0.1),
            "mirrored yaw",
            2.0 * np.sin(0.05),
        ),
    ],
)
def test_what_is_wrong_is_told_by_the_label_of_its_row_in_metres_or_radians(
    coupling: Coupling, bases: tuple[Base, Base], label: str, excess: float
) -> None:
    rows = coupling.rows(bases)
    outside = [max(low - v, v - high) for v, low, high in zip(rows.values, rows.lower, rows.upper, strict=True)]
    assert [told for told, by in zip(rows.labels, outside, strict=True) if by > 1e-6] == [label]
    assert max(outside) == pytest.approx(excess, abs=1e-6)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: SameHeight((0,)), "needs 2 or more arms, got 1"),
        (lambda: Distance((0, 1, 2)), "needs 2 arms, got 3"),
        (lambda: Mirror((0, 1, 2), (0.0, 0.0), 0.0), "needs 2 arms, got 3"),
        (lambda: Mirror((0,), (0.0, 0.0), 0.0), "needs 2 arms, got 1"),
        (lambda: Direction((0, 1, 2), 0.0), "needs 2 arms, got 3"),
        (lambda: Direction((1, 1), 0.0), "cannot be coupled with itself"),
        (lambda: Rail((), 0.0, (0.0, 0.0)), "needs 1 or more arms, got 0"),
        (lambda: Distance((0, 1), 2.0, 1.0), "between 2 m and 1 m"),
    ],
)
def test_a_refusal_says_what_is_needed(build: Callable[[], Coupling], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        build()


def test_one_arm_alone_may_stand_on_a_rail_whose_place_is_given() -> None:
    rows = Rail((0,), SIDE, HERE[:2]).rows(moved(across=0.1)[1:])
    assert rows.values == pytest.approx((0.1,))
    assert rows.labels == ("on the rail",)


def test_couplings_are_renumbered_or_dropped_with_their_arms() -> None:
    assert among(Direction((2, 0), 0.5), [0, 2]) == Direction((1, 0), 0.5)
    assert among(Rail((1, 2), 0.1, None), [1, 2]) == Rail((0, 1), 0.1, None)
    assert among(Distance((0, 1), 0.1, 0.2), [0, 2]) is None


@pytest.mark.parametrize(
    ("build", "pointer"),
    [
        (lambda: SameHeight((0,)), "/arms"),
        (lambda: SameHeight((0, 0)), "/arms"),
        (lambda: Distance((0, 1, 2)), "/arms"),
        (lambda: Distance((0, 1), 2.0, 1.0), "/minimum"),
        (lambda: Distance((0, 1), -1.0), "/minimum"),
        (lambda: Rail((0,), 0.0), "/arms"),
    ],
)
def test_impossible_couplings_are_refused(build: Callable[[], Coupling], pointer: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        build()
    assert caught.value.pointer == pointer
