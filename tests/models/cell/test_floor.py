"""Floor regions against shapely, point by point."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.cell.floor import OUTSIDE, POINT, Floor, Footprint

ROOM = np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]], dtype=float)  # an L
PIT = np.array([[2.0, 0.2], [2.5, 0.2], [2.5, 0.5], [2.0, 0.5]])
NOTCHED = np.array([[0, 2], [0.5, 2], [0.5, 2.2], [0.25, 2.05], [0, 2.2]])
PLATE = Footprint.rectangle(0.3, 0.5)


def placed(footprint: Footprint, point: Floats, yaw: float) -> shapely.Geometry:
    """The core of a footprint as a shapely geometry."""
    if len(footprint.corners) == 1:
        return shapely.Point(point + footprint.corners[0])
    turned = affinity.rotate(shapely.Polygon(footprint.corners), yaw, origin=(0, 0), use_radians=True)
    return affinity.translate(turned, *point)


def by_shapely(floor: Floor, footprint: Footprint, point: Floats, yaw: float) -> float | None:
    """Clearance where the footprint's core is free, else None."""
    shape = placed(footprint, point, yaw)
    gaps = [shape.distance(shapely.Polygon(p)) for p in floor.forbidden]
    if floor.allowed is not None:
        room = shapely.Polygon(floor.allowed)
        gaps.append(shape.distance(room.exterior) if room.contains(shape) else 0.0)
    return min(gaps) - footprint.radius - floor.margin if min(gaps) > 0.0 else None


@pytest.mark.parametrize("footprint", [POINT, Footprint.disc(0.2), PLATE], ids=["point", "disc", "plate"])
@pytest.mark.parametrize("margin", [0.0, 0.05])
def test_distances_are_those_of_shapely(footprint: Footprint, margin: float) -> None:
    floor = Floor(ROOM, (PIT, NOTCHED), margin)
    rng = np.random.default_rng(0)
    points, yaws = rng.uniform([-0.5, -0.5], [4.5, 3.5], (600, 2)), rng.uniform(-7.0, 7.0, 600)
    found = floor.signed_distance(points, footprint, yaws)
    free = 0
    for point, yaw, distance in zip(points, yaws, found, strict=True):
        expected = by_shapely(floor, footprint, point, yaw)
        if expected is None:
            assert distance <= -margin - footprint.radius + 1e-9
        else:
            assert distance == pytest.approx(expected, abs=1e-9)
            free += 1
    assert 20 < free < 580


@pytest.mark.parametrize("floor", [Floor(ROOM, (), 0.02), Floor(None, (PIT,), 0.02)], ids=["room", "pit"])
@given(st.tuples(st.floats(-0.5, 4.5), st.floats(-0.5, 3.5)), st.floats(-4.0, 4.0))
@settings(max_examples=60, deadline=None)
def test_the_half_plane_leads_out_and_turns_with_the_plate(
    floor: Floor, point: tuple[float, float], yaw: float
) -> None:
    here = np.array(point)
    plane = floor.half_plane(here, PLATE, yaw)
    distance = floor.signed_distance(here, PLATE, yaw)[0]
    assert plane is not None
    assert plane.distance == pytest.approx(distance, abs=1e-12)
    assert plane.normal @ here - plane.offset == pytest.approx(distance, abs=1e-12)
    moved = here
    for _ in range(12):  # over the nearest line, and over the next
        there = floor.half_plane(moved, PLATE, yaw)
        assert there is not None
        if there.distance < 0.0:
            moved = moved - (there.distance - 1e-6) * there.normal
    assert floor.signed_distance(moved, PLATE, yaw)[0] >= 0.0
    step = 1e-6
    slope = np.diff(floor.signed_distance([here, here], PLATE, [yaw - step, yaw + step]))[0] / (2.0 * step)
    kink = (
        abs(
            floor.signed_distance(here, PLATE, yaw + step)
            + floor.signed_distance(here, PLATE, yaw - step)
            - 2.0 * distance
        )[0]
        > 1e-9
    )
    assert kink or slope == pytest.approx(plane.yaw_slope, abs=1e-4)


@given(st.tuples(*[st.floats(-1.0, 5.0)] * 4), st.floats(-4.0, 4.0))
@settings(max_examples=60, deadline=None)
def test_one_metre_changes_the_distance_by_one_metre_at_most(
    points: tuple[float, float, float, float], yaw: float
) -> None:
    floor = Floor(ROOM, (PIT, NOTCHED), 0.02)
    ends = np.array(points).reshape(2, 2)
    distances = floor.signed_distance(ends, PLATE, yaw)
    assert abs(distances[1] - distances[0]) <= np.linalg.norm(ends[1] - ends[0]) + 1e-9


def test_a_plate_that_bridges_a_pit_is_on_it() -> None:
    bridge = Footprint.rectangle(2.0, 0.1)
    floor = Floor(forbidden=(np.array([[-0.05, -1.0], [0.05, -1.0], [0.05, 1.0], [-0.05, 1.0]]),))
    assert floor.signed_distance([0.0, 0.0], bridge)[0] < -0.9
    assert floor.signed_distance([0.0, 1.1], bridge)[0] == pytest.approx(0.05)


def test_yaw_matters_for_plates() -> None:
    floor = Floor(np.array([[0, 0], [1, 0], [1, 0.4], [0, 0.4]], dtype=float))
    assert floor.signed_distance([0.5, 0.2], PLATE, 0.0)[0] == pytest.approx(-0.05)
    assert floor.signed_distance([0.5, 0.2], PLATE, np.pi / 2)[0] == pytest.approx(0.05)


def test_without_polygons_everything_is_allowed() -> None:
    assert np.all(np.isinf(Floor().signed_distance([[0.0, 0.0], [1e3, 0.0]])))
    assert Floor().half_plane([0.0, 0.0]) is None


@pytest.mark.parametrize(
    ("floor", "point", "piece"),
    [
        (Floor(ROOM), [10.0, 0.5], OUTSIDE),
        (Floor(ROOM), [2.0, 2.0], OUTSIDE),  # in the dent of the L
        (Floor(ROOM, (PIT,)), [2.2, 0.3], "forbidden 0"),
    ],
)
def test_a_half_plane_says_what_it_leads_out_of(floor: Floor, point: list[float], piece: str) -> None:
    plane = floor.half_plane(point)
    assert plane is not None
    assert plane.piece == piece


@pytest.mark.parametrize(
    ("make", "pointer"),
    [
        (lambda: Floor(ROOM[:2]), "/allowed"),
        (lambda: Floor(ROOM[[0, 2, 1, 3]]), "/allowed"),
        (lambda: Floor(np.array([[0, 0], [1, 0], [2, 0]], dtype=float)), "/allowed"),
        (lambda: Floor(np.full((3, 2), np.nan)), "/allowed"),
        (lambda: Floor(ROOM, (PIT, PIT[:2])), "/forbidden/1"),
        (lambda: Floor(ROOM, (), -0.1), "/margin"),
        (lambda: Floor(ROOM, (), np.nan), "/margin"),
        (lambda: Footprint.disc(-1.0), "/radius"),
        (lambda: Footprint.rectangle(0.0, 1.0), "/size"),
        (lambda: Footprint.polygon(ROOM), "/corners"),
    ],
)
def test_refused_with_a_pointer(make: Callable[[], object], pointer: str) -> None:
    with pytest.raises(InvalidInput) as error:
        make()
    assert error.value.pointer == pointer


def test_corners_may_run_either_way_round() -> None:
    points = np.random.default_rng(1).uniform(-1, 5, (50, 2))
    forth, back = Floor(ROOM, (PIT,)), Floor(ROOM[::-1], (PIT[::-1],))
    assert np.allclose(forth.signed_distance(points, PLATE), back.signed_distance(points, PLATE))
