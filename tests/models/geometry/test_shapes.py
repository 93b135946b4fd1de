"""Shapes and bodies: what is refused, and what a hull keeps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import transform
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, Sphere

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)


@pytest.mark.parametrize(
    ("make", "pointer"),
    [
        (lambda: Box(np.array([1.0, 0.0, 1.0])), "/size/1"),
        (lambda: Box(np.array([1.0, 1.0])), "/size"),
        (lambda: Box(np.array([1.0, 1.0, np.nan])), "/size/2"),
        (lambda: Sphere(-0.1), "/radius"),
        (lambda: Sphere(5000.0), "/radius"),
        (lambda: Cylinder(0.1, np.inf), "/length"),
        (lambda: Cylinder(0.0, 1.0), "/radius"),
        (lambda: Capsule(0.1, -1.0), "/length"),
        (lambda: ConvexHull(CUBE[:3]), "/points"),
        (lambda: ConvexHull(CUBE[CUBE[:, 2] == 0]), "/points"),
        (lambda: ConvexHull(CUBE * [1, 1, 1e-9]), "/points"),
        (lambda: ConvexHull(CUBE + np.inf), "/points"),
        (lambda: ConvexHull(np.zeros((4, 2))), "/points"),
        (lambda: Body("b", np.eye(3), Sphere(1.0)), "/pose"),
        (lambda: Body("b", 2.0 * np.eye(4), Sphere(1.0)), "/pose"),
        (lambda: Body("b", np.diag([1.0, 1.0, -1.0, 1.0]), Sphere(1.0)), "/pose"),
        (lambda: Body("b", np.full((4, 4), np.nan), Sphere(1.0)), "/pose"),
        (lambda: Body("b", transform(np.eye(3), [1e5, 0, 0]), Sphere(1.0)), "/pose/position"),
    ],
)
def test_refused_with_a_pointer(make: Callable[[], object], pointer: str) -> None:
    with pytest.raises(InvalidInput) as error:
        make()
    assert error.value.pointer == pointer
    assert len(error.value.detail) > 20


def test_a_hull_keeps_its_corners_and_faces_only() -> None:
    rng = np.random.default_rng(0)
    hull = ConvexHull(np.vstack([CUBE, rng.uniform(0.0, 1.0, (50, 3))]))
    assert sorted(map(tuple, hull.points)) == sorted(map(tuple, CUBE))
    assert len(hull.planes) == 6
    middle = np.full(3, 0.5)
    assert np.allclose(hull.planes[:, :3] @ middle + hull.planes[:, 3], -0.5)


def test_arrays_of_shapes_are_read_only_copies() -> None:
    size = np.ones(3)
    box = Box(size)
    size[0] = 2.0
    assert box.size[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        box.size[0] = 3.0
