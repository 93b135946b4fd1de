"""Signed distances of points from convex shapes, and of segments from each other, many at once.

The signed distance of a point is its distance from the shape, inside of it minus the depth. For a convex shape it is a
convex function of the point: over a box its maximum is at a corner.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.geometry.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere


def gap(shape: Shape, frame: Floats, points: Floats) -> Floats:
    """(...) m, no less than the signed distances of points (..., 3) from a shape at ``frame`` (4, 4).

    Exact but outside of hulls, where the distance from a ball inside stands in for the one that is not known.
    """
    local = (points - frame[:3, 3]) @ frame[:3, :3]
    match shape:
        case Sphere(radius=radius):
            return np.asarray(np.linalg.norm(local, axis=-1) - radius)
        case Capsule(radius=radius, length=length):
            local[..., 2] -= np.clip(local[..., 2], -0.5 * length, 0.5 * length)
            return np.asarray(np.linalg.norm(local, axis=-1) - radius)
        case Cylinder(radius=radius, length=length):
            aside = np.hypot(local[..., 0], local[..., 1]) - radius
            return _beyond(np.stack([aside, np.abs(local[..., 2]) - 0.5 * length], axis=-1))
        case Box(size=size):
            return _beyond(np.abs(local) - 0.5 * size)
        case HalfSpace():
            return np.asarray(local[..., 2])
        case ConvexHull(points=corners, planes=planes):
            height = np.max(local @ planes[:, :3].T + planes[:, 3], axis=-1)
            middle = corners.mean(axis=0)
            radius = float(np.min(-(planes[:, :3] @ middle + planes[:, 3])))
            return np.asarray(np.where(height > 0.0, np.linalg.norm(local - middle, axis=-1) - radius, height))


def inside(shape: Shape, frame: Floats, points: Floats) -> Floats:
    """(...) m, minus the depths of points (..., 3) in a shape; 0 or more outside."""
    found = gap(shape, frame, points)
    if isinstance(shape, ConvexHull):
        local = (points - frame[:3, 3]) @ frame[:3, :3]
        found = np.max(local @ shape.planes[:, :3].T + shape.planes[:, 3], axis=-1)
    return found


def _beyond(excess: Floats) -> Floats:
    """(...) m, signed distance from a product of intervals, by how far a point is beyond each of them (..., k)."""
    out = np.maximum(excess, 0.0)
    most = excess[..., 0]
    for k in range(1, excess.shape[-1]):  # over an axis of two or three, `np.max` takes several times as long
        most = np.maximum(most, excess[..., k])
    distance: Floats = np.sqrt(np.einsum("...k,...k->...", out, out)) + np.minimum(most, 0.0)
    return distance


def segment_gaps(first: Floats, second: Floats) -> tuple[Floats, Floats, Floats]:
    """Distances (...) m of segments with ends (..., 2, 3) m, and the shares (...) of the way to the nearest points.

    Where rounding spoils the shares of nearly parallel segments, the distance is still that of two of their points.
    """
    u, v = first[..., 1, :] - first[..., 0, :], second[..., 1, :] - second[..., 0, :]
    apart = first[..., 0, :] - second[..., 0, :]
    a, e, b = _dot(u, u), _dot(v, v), _dot(u, v)
    c, f = _dot(u, apart), _dot(v, apart)
    square = a * e - b * b
    crossing = square > 1e-12 * a * e
    s = np.where(crossing, np.clip((b * f - c * e) / np.where(crossing, square, 1.0), 0.0, 1.0), 0.0)
    t = np.clip((b * s + f) / np.maximum(e, 1e-300), 0.0, 1.0)
    s = np.clip((b * t - c) / np.maximum(a, 1e-300), 0.0, 1.0)
    between = apart + s[..., None] * u - t[..., None] * v
    return np.sqrt(_dot(between, between)), s, t


def _dot(one: Floats, other: Floats) -> Floats:
    product: Floats = np.einsum("...a,...a->...", one, other)
    return product
