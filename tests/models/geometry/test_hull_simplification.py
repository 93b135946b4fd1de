"""Hulls with few corners: they contain the many, and are not much larger."""

from __future__ import annotations

import time

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull as Hull

from duocell.models.base.arrays import Floats
from duocell.models.geometry.decomposition import decompose
from duocell.models.geometry.hull_simplification import MOST_CORNERS, enclosing_corners
from duocell.models.geometry.meshes import Mesh


def sticking_out(points: Floats, hull: Hull) -> float:
    """How far the worst of some points lies outside of a hull."""
    return float(np.max(points @ hull.equations[:, :3].T + hull.equations[:, 3]))


@settings(max_examples=15)
@given(st.integers(0, 2**32 - 1))
def test_many_corners_are_enclosed_by_few(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ball = rng.normal(size=(rng.integers(300, 2000), 3))
    points = ball / np.linalg.norm(ball, axis=1, keepdims=True) * rng.uniform(0.02, 1.0, 3) + rng.normal(size=3)
    hull = Hull(points)
    corners = enclosing_corners(hull)
    assert len(corners) <= MOST_CORNERS
    assert sticking_out(points, Hull(corners)) < 1e-9
    assert sticking_out(corners, hull) < 0.05 * np.ptp(points, axis=0).max()


def test_few_corners_stay_as_they_are() -> None:
    hull = Hull(trimesh.creation.box((1.0, 2.0, 3.0)).vertices)
    assert np.array_equal(enclosing_corners(hull), hull.points[hull.vertices])


def test_flat_sides_stay_where_they_are() -> None:
    plate = trimesh.creation.cylinder(0.5, 0.01, sections=1000)
    corners = enclosing_corners(Hull(plate.vertices))
    assert np.ptp(corners[:, 2]) == pytest.approx(0.01, abs=1e-9)
    assert np.hypot(corners[:, 0], corners[:, 1]).max() < 0.5005


def test_a_ball_of_many_triangles_is_quickly_a_piece_of_few_corners() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5)
    started = time.perf_counter()
    (piece,) = decompose(Mesh(ball.vertices, ball.faces)).pieces
    assert len(piece.points) <= MOST_CORNERS
    assert time.perf_counter() - started < 10.0
