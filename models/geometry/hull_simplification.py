"""Hulls with few corners around points with many: what a distance costs grows with the corners."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull as Hull
from scipy.spatial import HalfspaceIntersection

from duocell.models.base.arrays import Floats, Ints

MOST_CORNERS = 256
"""A ball with as many sticks out by 4 % of its radius."""

TIGHT = 1e-4
"""Of the longest side: what sticks out less needs no further plane."""

_MOST_PLANES = MOST_CORNERS // 2 + 2
"""At most 2 p - 4 corners come of p planes (Euler)."""

_AT_ONCE = 12
"""Planes that are added before the corners are computed anew."""


def enclosing_corners(hull: Hull) -> Floats:
    """Corners of a hull, or of a polyhedron around it if they are more than `MOST_CORNERS`.

    The polyhedron begins as the bounding box. Again and again the corners that stick out farthest are cut off, each
    with the plane of the hull's own face that it is farthest beyond; so large flat sides stay where they are.

    Args:
        hull: of points in three dimensions.

    Returns:
        (k, 3); their hull contains the given one.
    """
    points = hull.points[hull.vertices]
    if len(points) <= MOST_CORNERS:
        return points.copy()
    box = np.vstack([np.eye(3), -np.eye(3)])
    planes = np.column_stack([box, -(points @ box.T).max(axis=0)])
    enough = TIGHT * float(np.ptp(points, axis=0).max())
    while True:
        corners = _corners_of(planes, points.mean(axis=0))
        faces, beyond = _farthest_beyond(corners, hull.equations)
        farthest = np.argsort(-beyond, kind="stable")
        chosen = list(dict.fromkeys(int(faces[i]) for i in farthest if beyond[i] > enough))
        chosen = chosen[: min(_AT_ONCE, _MOST_PLANES - len(planes))]
        if not chosen:
            return corners
        planes = np.vstack([planes, hull.equations[chosen]])


def _corners_of(planes: Floats, inside: Floats) -> Floats:
    """(k, 3) corners of the polyhedron that planes (p, 4) leave over."""
    corners: Floats = HalfspaceIntersection(planes, inside).intersections
    return corners[np.all(np.isfinite(corners), axis=1)]


def _farthest_beyond(corners: Floats, planes: Floats) -> tuple[Ints, Floats]:
    """For each corner (k, 3) the index of the plane (f, 4) that it is farthest beyond, and how far [m]."""
    indices, distances = np.empty(len(corners), dtype=np.int64), np.empty(len(corners))
    for i, corner in enumerate(corners):  # one by one: both may be many
        beyond = planes[:, :3] @ corner + planes[:, 3]
        indices[i] = np.argmax(beyond)
        distances[i] = beyond[indices[i]]
    return indices, distances
