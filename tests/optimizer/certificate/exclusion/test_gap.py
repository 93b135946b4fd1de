"""Distances of points and segments, against Coal and against dense samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from duocell.models.base.pose import transform
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from duocell.optimizer.certificate.exclusion.gap import gap, segment_gaps

POINTS = np.random.default_rng(5).normal(size=(20, 3))
SHAPES: tuple[Shape, ...] = (
    Box(np.array([0.4, 0.6, 1.0])),
    Sphere(0.5),
    Capsule(0.3, 0.8),
    Cylinder(0.4, 0.7),
    HalfSpace(),
    ConvexHull(0.4 * POINTS),
)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_gaps_are_the_distances_of_a_tiny_ball(shape: Shape) -> None:
    rng = np.random.default_rng(1)
    frame = transform(Rotation.random(rng=rng).as_matrix(), rng.normal(size=3))
    points = frame[:3, 3] + rng.choice([0.15, 0.6], (60, 1)) * rng.normal(size=(60, 3))
    ball = Sphere(1e-4)
    known = [separation(ball, transform(np.eye(3), p), shape, frame).distance + ball.radius for p in points]
    found = gap(shape, frame, points)
    assert np.all(found >= np.array(known) - 2e-6)
    exact = found < 0.0 if isinstance(shape, ConvexHull) else np.ones(len(points), dtype=bool)
    assert exact.sum() > 10
    assert np.abs(found - known)[exact].max() < 2e-6


def test_gaps_of_segments() -> None:
    rng = np.random.default_rng(2)
    first, second = rng.normal(size=(2, 40, 2, 3))
    second[:5] = first[:5] + 0.3  # parallel
    first[5:9, 1] = first[5:9, 0]  # points
    found, s, t = segment_gaps(first, second)
    way = np.linspace(0.0, 1.0, 201)
    on_first = first[:, None, 0] + way[:, None] * (first[:, 1] - first[:, 0])[:, None]
    on_second = second[:, None, 0] + way[:, None] * (second[:, 1] - second[:, 0])[:, None]
    dense = np.linalg.norm(on_first[:, :, None] - on_second[:, None], axis=-1).min(axis=(1, 2))
    assert np.all(found <= dense + 1e-12)
    assert np.all(found >= dense - 0.03)
    nearest = (1 - s)[:, None] * first[:, 0] + s[:, None] * first[:, 1]
    other = (1 - t)[:, None] * second[:, 0] + t[:, None] * second[:, 1]
    assert np.allclose(np.linalg.norm(nearest - other, axis=1), found)
