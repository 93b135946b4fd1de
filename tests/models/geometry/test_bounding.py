"""Bounds never promise more room than there is."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings

from duocell.models.base.arrays import Floats
from duocell.models.geometry.bounding import (
    Bounding,
    bounding,
    box_distances,
    box_gaps,
    enclosing_capsule,
    exact_box_distances,
    segment_distances,
)
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Box, Capsule, HalfSpace, Shape, Sphere
from tests.support.given.solids import KINDS, SEED, random_box, random_pose, random_shape, surface_points


def placed(shape: Shape, pose: Floats) -> tuple[Bounding, Floats]:
    bound = bounding(shape)
    return bound, bound.ends @ pose[:3, :3].T + pose[:3, 3]


@pytest.mark.parametrize("kind", KINDS)
def test_capsule_and_box_contain_the_solid(kind: type[Shape]) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        shape = random_shape(kind, rng)
        bound = bounding(shape)
        points = surface_points(shape, np.eye(4), rng)
        spots = np.stack([points, points], axis=1)
        assert np.all(segment_distances(spots, bound.ends[None]) <= bound.radius + 1e-9)
        assert np.all(np.abs(points - bound.centre) <= bound.half + 1e-9)


@pytest.mark.parametrize(("first", "second"), list(product(KINDS, KINDS)))
def test_bounds_are_below_the_distance_and_equal_it_for_rounded_bodies(first: type[Shape], second: type[Shape]) -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        a, b = random_shape(first, rng), random_shape(second, rng)
        a_pose, b_pose = random_pose(rng), random_pose(rng)
        (a_bound, a_ends), (b_bound, b_ends) = placed(a, a_pose), placed(b, b_pose)
        distance = separation(a, a_pose, b, b_pose).distance
        by_capsules = segment_distances(a_ends, b_ends) - a_bound.radius - b_bound.radius
        by_box = box_distances((a_ends - b_pose[:3, 3]) @ b_pose[:3, :3] - b_bound.centre, b_bound.half)
        assert by_capsules <= distance + 1e-6
        assert by_box - a_bound.radius <= distance + 2e-4  # Coal's own error for penetrating cylinders
        if a_bound.exact and b_bound.exact:
            assert by_capsules == pytest.approx(distance, abs=1e-6)


@settings(max_examples=100, deadline=None)
@given(SEED)
def test_segment_distances_are_those_of_a_fine_search(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, second = rng.integers(-3, 4, (2, 2, 3)).astype(float)  # often parallel, crossing or of no length
    s, t = np.meshgrid(np.linspace(0, 1, 61), np.linspace(0, 1, 61))
    points = first[0] + s[..., None] * (first[1] - first[0]) - second[0] - t[..., None] * (second[1] - second[0])
    searched = float(np.min(np.linalg.norm(points, axis=-1)))
    found = float(segment_distances(first, second))
    assert found <= searched + 1e-12
    longest = max(np.linalg.norm(first[1] - first[0]), np.linalg.norm(second[1] - second[0]))
    assert found >= searched - longest / 60.0


def test_the_capsule_around_a_rod_of_points_is_slim() -> None:
    rng = np.random.default_rng(0)
    angles, heights = rng.uniform(0, 2 * np.pi, 400), rng.uniform(-1, 1, 400)
    points = np.column_stack([3.0 + 0.1 * np.cos(angles), 2.0 + 0.1 * np.sin(angles), heights])
    ends, radius = enclosing_capsule(points)
    assert radius == pytest.approx(0.1, abs=0.01)
    assert np.linalg.norm(ends[1] - ends[0]) < 2.0


def test_one_ball_around_a_ball_of_points() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    ends, radius = enclosing_capsule(points)
    assert radius < 1.1
    assert np.linalg.norm(ends[1] - ends[0]) < 0.2


def test_inside_a_box_the_bound_is_the_depth() -> None:
    ends = np.array([[0.1, 0.0, 0.0], [0.2, 0.0, 0.0]])
    assert box_distances(ends, np.array([0.5, 1.0, 1.0])) == pytest.approx(-0.4)


def test_nothing_bounds_a_half_space() -> None:
    with pytest.raises(ValueError, match="half-space"):
        bounding(HalfSpace())


def test_exact_for_balls_and_capsules_only() -> None:
    assert bounding(Sphere(0.1)).exact
    assert bounding(Capsule(0.1, 0.2)).exact
    assert not bounding(Box(np.ones(3))).exact


@settings(max_examples=50, deadline=None)
@given(SEED)
def test_distances_from_boxes_are_those_of_a_fine_search(seed: int) -> None:
    rng = np.random.default_rng(seed)
    half = rng.integers(1, 3, (40, 1, 3)).astype(float)
    ends = rng.integers(-4, 5, (40, 2, 3)).astype(float)  # often along a side, through a corner or of no length
    ends[20:] += rng.uniform(-0.5, 0.5, (20, 2, 3))
    shares = np.linspace(0.0, 1.0, 1001)[:, None]
    points = ends[:, :1] + shares * (ends[:, 1:] - ends[:, :1])
    searched = np.min(np.linalg.norm(points - np.clip(points, -half, half), axis=2), axis=1)
    found = exact_box_distances(ends, half[:, 0])
    assert np.all(found <= searched + 1e-12)
    assert np.all(found >= searched - np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 1000.0 - 1e-12)


@settings(max_examples=100, deadline=None)
@given(SEED)
def test_capsules_beside_boxes_are_as_far_as_coal_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    box, capsule = random_box(rng), random_shape(Capsule, rng)
    box_pose, capsule_pose = random_pose(rng), random_pose(rng)
    bound, ends = placed(capsule, capsule_pose)
    apart = float(exact_box_distances((ends - box_pose[:3, 3]) @ box_pose[:3, :3], 0.5 * box.size))
    distance = separation(box, box_pose, capsule, capsule_pose).distance
    if apart > 0.0:
        assert apart - bound.radius == pytest.approx(distance, abs=1e-6)
    else:
        assert distance <= -bound.radius + 1e-6


@settings(max_examples=200, deadline=None)
@given(SEED)
def test_gaps_between_boxes_are_below_the_distance_and_equal_the_depth(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = [random_box(rng) for _ in range(2)]
    poses = [random_pose(rng, 0.3) for _ in range(2)]
    if seed % 3 == 0:
        poses[1][:3, :3] = poses[0][:3, :3]  # parallel edges have no normal
    gap = float(box_gaps(poses[0], 0.5 * boxes[0].size, poses[1], 0.5 * boxes[1].size))
    distance = separation(boxes[0], poses[0], boxes[1], poses[1]).distance
    assert gap <= distance + 1e-6
    if distance < 0.0:
        assert gap == pytest.approx(distance, abs=1e-5)
