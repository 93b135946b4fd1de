"""How deep the dents are that a convex hull fills: distances from its surface back to the triangles inside of it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull as Hull
from scipy.spatial import cKDTree

from duocell.models.base.arrays import Floats
from duocell.models.base.sampling import even_points

HULL_SAMPLES, MESH_SAMPLES = 600, 4000
NEAREST = 12
"""Samples of the mesh whose triangles are measured for a point of the hull."""


def sampled(triangles: Floats, count: int) -> tuple[Floats, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Points spread evenly over the area of triangles, the same ones every time.

    Args:
        triangles: (f, 3, 3). count: of the points.

    Returns:
        (count, 3) points, and (count,) the triangle of each.
    """
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    total = np.cumsum(areas)
    numbers = even_points(3, count, 0)
    owners = np.minimum(np.searchsorted(total, numbers[:, 0] * total[-1]), len(triangles) - 1)
    root = np.sqrt(numbers[:, 1:2])
    a, b, c = (triangles[owners, i] for i in range(3))
    points: Floats = (1.0 - root) * a + root * (1.0 - numbers[:, 2:]) * b + root * numbers[:, 2:] * c
    return points, owners


def deepest_dent(hull: Hull, triangles: Floats, cuts: Floats) -> float:
    """The largest distance of a place on a hull's surface from the triangles that it was made around, as sampled.

    Args:
        hull: of the triangles' corners.
        triangles: (f, 3, 3).
        cuts: (k, 4) planes at which the triangles were cut off: what is hollow there was solid.

    Returns:
        In the units of the triangles; 0 where all of the surface lies on cuts.
    """
    faces = hull.points[hull.simplices]
    size = float(np.ptp(hull.points, axis=0).max())
    on_cut = np.zeros(len(faces), dtype=bool)
    for cut in cuts:
        on_cut |= np.all(np.abs(faces @ cut[:3] + cut[3]) < 1e-6 * size, axis=1)
    if np.all(on_cut):
        return 0.0
    points = np.vstack([sampled(faces[~on_cut], HULL_SAMPLES)[0], faces[~on_cut].mean(axis=1)])
    spread, owners = sampled(triangles, MESH_SAMPLES)  # large triangles need many points, small ones their middles
    known = np.vstack([spread, triangles.mean(axis=1)])
    owners = np.concatenate([owners, np.arange(len(triangles))])
    _, near = cKDTree(known).query(points, k=NEAREST)
    distances = _to_triangles(points[:, None], triangles[owners[near]])
    return float(np.max(np.min(distances, axis=1)))


def _to_triangles(points: Floats, triangles: Floats) -> Floats:
    """(n, k) distances of points (n, 1, 3) from triangles (n, k, 3, 3)."""
    a, b, c = (triangles[..., i, :] for i in range(3))
    normal = np.cross(b - a, c - a)
    square = np.sum(normal * normal, axis=-1)
    lift = np.sum((points - a) * normal, axis=-1)
    inside = square > 0.0
    to_edges = []
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        inside &= np.sum(np.cross(edge, points - start) * normal, axis=-1) >= 0.0
        length = np.maximum(np.sum(edge * edge, axis=-1), 1e-300)
        share = np.clip(np.sum((points - start) * edge, axis=-1) / length, 0.0, 1.0)
        to_edges.append(np.linalg.norm(points - start - share[..., None] * edge, axis=-1))
    plane = np.abs(lift) / np.sqrt(np.maximum(square, 1e-300))
    distances: Floats = np.where(inside, plane, np.min(to_edges, axis=0))
    return distances
