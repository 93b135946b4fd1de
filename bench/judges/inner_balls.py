"""Balls inside of bodies, and distances of points from shapes: what surely collides is thrown out many at a time.

A ball lies inside its body, so two bodies are at most as far apart as their balls: a rejection is never wrong, an
acceptance means nothing.

`duocell.optimizer.coupled.candidates.contacts` has the same idea and shares nothing with this on purpose: a search that
shared its distances could not contradict it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere

SPACING = 1.3
"""Distance of neighbouring balls over their radius."""


class Balls:
    """Balls of bodies, in the frames that the bodies move with.

    Attributes:
        centres: (n, 3) m. radii: (n,) m. frames: (n,) number of the frame of each.
    """

    def __init__(self, bodies: Sequence[Body], frames: Sequence[int]) -> None:
        """Fill bodies with balls; ``frames`` numbers the frame of each body."""
        rows = [
            (body.pose[:3, :3] @ centre + body.pose[:3, 3], radius, frame)
            for body, frame in zip(bodies, frames, strict=True)
            for centre, radius in _balls(body.shape)
        ]
        self.centres: Floats = np.array([row[0] for row in rows]).reshape(-1, 3)
        self.radii: Floats = np.array([row[1] for row in rows], dtype=np.float64)
        self.frames: Ints = np.array([row[2] for row in rows], dtype=np.int64)

    def placed(self, frames: Floats) -> Floats:
        """(..., n, 3) centres for frames (..., F, 4, 4) in the world."""
        own = frames[..., self.frames, :, :]
        places: Floats = np.einsum("...nij,nj->...ni", own[..., :3, :3], self.centres) + own[..., :3, 3]
        return places


def _balls(shape: Shape) -> list[tuple[Floats, float]]:
    """Balls inside of a shape, in its frame."""
    match shape:
        case Sphere(radius=radius):
            return [(np.zeros(3), radius)]
        case Capsule(radius=radius, length=length):
            return _row(2, 0.5 * length, radius)
        case Cylinder(radius=radius, length=length):
            inner = min(radius, 0.5 * length)
            return _row(2, 0.5 * length - inner, inner)
        case Box(size=size):
            inner, axis = 0.5 * float(np.min(size)), int(np.argmax(size))
            return _row(axis, 0.5 * float(size[axis]) - inner, inner)
        case ConvexHull(points=points, planes=planes):
            middle = points.mean(axis=0)
            return [(middle, float(np.min(-(planes[:, :3] @ middle + planes[:, 3]))))]
        case HalfSpace():
            return []


def _row(axis: int, half: float, radius: float) -> list[tuple[Floats, float]]:
    """Balls along an axis, from ``-half`` to ``half``."""
    count = 1 if half <= 0.0 else 1 + ceil(2.0 * half / (SPACING * radius))
    return [(np.eye(3)[axis] * at, radius) for at in np.linspace(-half, half, count)]


def point_distances(body: Body, points: Floats) -> Floats:
    """(...) m, signed distances of points (..., 3) from a body, all in one frame.

    Exact but for the hull, where points outside count as infinitely far.
    """
    local = (points - body.pose[:3, 3]) @ body.pose[:3, :3]
    match body.shape:
        case Sphere(radius=radius):
            return np.asarray(np.linalg.norm(local, axis=-1) - radius)
        case Capsule(radius=radius, length=length):
            local[..., 2] -= np.clip(local[..., 2], -0.5 * length, 0.5 * length)
            return np.asarray(np.linalg.norm(local, axis=-1) - radius)
        case Cylinder(radius=radius, length=length):
            aside = np.hypot(local[..., 0], local[..., 1]) - radius
            return _edged(np.stack([aside, np.abs(local[..., 2]) - 0.5 * length], axis=-1))
        case Box(size=size):
            return _edged(np.abs(local) - 0.5 * size)
        case HalfSpace():
            return np.asarray(local[..., 2])
        case ConvexHull(planes=planes):
            height = np.max(local @ planes[:, :3].T + planes[:, 3], axis=-1)
            return np.where(height > 0.0, np.inf, height)


def _edged(beyond: Floats) -> Floats:
    """Signed distance from how far a point is beyond each pair of faces (..., k)."""
    outside: Floats = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1) + np.minimum(np.max(beyond, axis=-1), 0.0)
    return outside
