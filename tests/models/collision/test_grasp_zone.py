"""The part without its grasp zones: nothing outside is lost, and what is near a grasp is gone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from duocell.models.base.arrays import Floats
from duocell.models.collision.grasp_zone import outside_zones
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, Shape, Sphere
from tests.support.given.solids import KINDS, SEED, random_pose, random_shape

SPECK = Sphere(1e-5)


def depth(bodies: tuple[Body, ...] | list[Body], point: Floats | list[float]) -> float:
    """Signed distance of a point from the nearest of some bodies."""
    pose = np.eye(4)
    pose[:3, 3] = point
    return min((separation(SPECK, pose, b.shape, b.pose).distance for b in bodies), default=np.inf)


@pytest.mark.parametrize("kind", KINDS)
@given(SEED)
@settings(max_examples=15, deadline=None)
def test_points_of_the_part_outside_of_the_zone_stay(kind: type[Shape], seed: int) -> None:
    rng = np.random.default_rng(seed)
    body = Body("part", random_pose(rng), random_shape(kind, rng))
    zone = rng.uniform(0.01, 0.3)
    grasp = body.pose[:3, 3] + rng.uniform(-0.3, 0.3, 3)
    pieces = outside_zones([body], grasp[None], zone)
    for point in body.pose[:3, 3] + rng.uniform(-0.4, 0.4, (40, 3)):
        if np.any(np.abs(body.pose[:3, :3].T @ (point - grasp)) > zone) and depth([body], point) < -1e-4:
            assert depth(pieces, point) < 1e-5


@pytest.mark.parametrize(
    "shape",
    [
        Box(np.array([1.2, 0.08, 0.08])),
        ConvexHull(0.5 * np.array([1.2, 0.08, 0.08]) * [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]),
    ],
)
def test_a_beam_loses_a_length_around_each_grasp(shape: Shape) -> None:
    beam = Body("beam", np.eye(4), shape)
    pieces = outside_zones([beam], np.array([[-0.5, 0.0, 0.05], [0.5, 0.0, 0.05]]), 0.095)
    assert len(pieces) == 3
    assert depth(pieces, [-0.5, 0.0, 0.0]) > 0.04
    assert depth(pieces, [0.0, 0.0, 0.0]) < 0.0
    assert depth(pieces, [0.598, 0.0, 0.0]) < 0.0
    assert all(piece.name == "beam" for piece in pieces)


def test_a_plate_keeps_what_lies_beside_the_grasp() -> None:
    plate = Body("plate", np.eye(4), Box(np.array([1.0, 1.0, 0.02])))
    pieces = outside_zones([plate], np.array([[0.5, 0.0, 0.0]]), 0.1)
    assert depth(pieces, [0.5, 0.0, 0.0]) > 0.09
    for point in ([0.3, 0.0, 0.0], [0.49, 0.2, 0.0], [0.49, -0.2, 0.0]):
        assert depth(pieces, point) < 0.0


@pytest.mark.parametrize("shape", [Sphere(0.05), Capsule(0.05, 0.1), Cylinder(0.05, 0.1), Box(np.full(3, 0.1))])
def test_small_parts_vanish_in_the_zone(shape: Shape) -> None:
    assert outside_zones([Body("part", np.eye(4), shape)], np.zeros((1, 3)), 0.2) == ()


@pytest.mark.parametrize("kind", KINDS)
def test_far_from_the_grasps_or_without_a_zone_nothing_changes(kind: type[Shape]) -> None:
    rng = np.random.default_rng(0)
    body = Body("part", random_pose(rng), random_shape(kind, rng))
    assert outside_zones([body], np.array([[5.0, 5.0, 5.0]]), 0.1) == (body,)
    assert outside_zones([body], body.pose[None, :3, 3], 0.0) == (body,)
