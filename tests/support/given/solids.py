"""Solids for tests, and signed distances from support functions: slow, and nothing to do with Coal."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere

KINDS: tuple[type[Shape], ...] = (Box, Sphere, Cylinder, Capsule, ConvexHull)

FLOOR = Body("floor", np.eye(4), HalfSpace())
"""The world below z = 0."""


def random_box(rng: np.random.Generator) -> Box:
    return Box(rng.uniform(0.02, 0.6, 3))


def random_shape(kind: type[Shape], rng: np.random.Generator) -> Shape:
    if kind is Box:
        return random_box(rng)
    if kind is Sphere:
        return Sphere(rng.uniform(0.02, 0.3))
    if kind is ConvexHull:
        return ConvexHull(rng.normal(size=(rng.integers(5, 30), 3)) * rng.uniform(0.05, 0.3, 3))
    assert kind is Cylinder or kind is Capsule
    return kind(rng.uniform(0.02, 0.3), rng.uniform(0.02, 0.8))


def random_pose(rng: np.random.Generator, size: float = 0.5) -> Floats:
    return transform(Rotation.random(rng=rng).as_matrix(), rng.uniform(-size, size, 3))


SEED = st.integers(0, 2**32 - 1)


def support(shape: Shape, pose: Floats, directions: Floats) -> Floats:
    """(k,) m: how far a solid reaches in directions (k, 3)."""
    local = directions @ pose[:3, :3]
    if isinstance(shape, Box):
        reach = np.abs(local) @ (0.5 * shape.size)
    elif isinstance(shape, Sphere):
        reach = np.full(len(local), shape.radius)
    elif isinstance(shape, Capsule):
        reach = shape.radius + 0.5 * shape.length * np.abs(local[:, 2])
    elif isinstance(shape, Cylinder):
        reach = shape.radius * np.hypot(local[:, 0], local[:, 1]) + 0.5 * shape.length * np.abs(local[:, 2])
    elif isinstance(shape, HalfSpace):
        reach = np.where(local[:, 2] > 1.0 - 1e-12, 0.0, np.inf)
    else:
        reach = np.max(local @ shape.points.T, axis=1)
    farthest: Floats = reach + directions @ pose[:3, 3]
    return farthest


def signed_distance(first: Shape, first_pose: Floats, second: Shape, second_pose: Floats) -> float:
    """The widest gap between two solids over all directions; negative: the depth of the shallowest way out."""

    def gaps(directions: Floats) -> Floats:
        gap: Floats = -support(first, first_pose, directions) - support(second, second_pose, -directions)
        return gap

    if isinstance(second, HalfSpace):
        return float(gaps(-second_pose[:3, 2][None])[0])
    count = 4000
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    ring = np.sqrt(1.0 - z * z)
    grid = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
    rng = np.random.default_rng(0)
    best = -np.inf
    order = np.argsort(-gaps(grid))
    starts: list[Floats] = []
    for index in order:  # the best few that are not neighbours
        if all(grid[index] @ other < 0.98 for other in starts):
            starts.append(grid[index])
        if len(starts) == 8:
            break
    for start in starts:
        centre, value, width = start, float(gaps(start[None])[0]), 0.08
        while width > 1e-8:
            around = centre + width * rng.normal(size=(160, 3))
            around /= np.linalg.norm(around, axis=1, keepdims=True)
            found = gaps(around)
            k = int(np.argmax(found))
            if found[k] > value:
                centre, value = around[k], float(found[k])
            else:
                width *= 0.6
        best = max(best, value)
    return best


def surface_points(shape: Shape, pose: Floats, rng: np.random.Generator, count: int = 60) -> Floats:
    """(count, 3) points of a solid: where random planes touch it."""
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    local = directions @ pose[:3, :3]
    if isinstance(shape, Box):
        points = 0.5 * shape.size * np.sign(local)
    elif isinstance(shape, Sphere):
        points = shape.radius * local
    elif isinstance(shape, Capsule):
        points = shape.radius * local + 0.5 * shape.length * np.sign(local[:, 2:]) * [0.0, 0.0, 1.0]
    elif isinstance(shape, Cylinder):
        ring = local[:, :2] / np.linalg.norm(local[:, :2], axis=1, keepdims=True)
        points = np.column_stack([shape.radius * ring, 0.5 * shape.length * np.sign(local[:, 2])])
    else:
        assert isinstance(shape, ConvexHull)
        points = shape.points[np.argmax(local @ shape.points.T, axis=1)]
    placed: Floats = points @ pose[:3, :3].T + pose[:3, 3]
    return placed
