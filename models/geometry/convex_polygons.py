"""Polygons in the plane: checked, cut into convex parts, and distances between convex ones."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput

MOST_CORNERS = 1000

FAR = 1e4
"""m; farther than any floor reaches."""


def simple_polygon(corners: ArrayLike, pointer: str) -> Floats:
    """Corners (k, 2) of a polygon without crossings, counter-clockwise, a repeated last corner removed.

    Raises:
        InvalidInput: not so; ``pointer`` names it.
    """
    points = np.asarray(corners, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or not 3 <= len(points) <= MOST_CORNERS:
        raise InvalidInput(f"a polygon needs 3 to {MOST_CORNERS} corners [x, y]; got shape {points.shape}.", pointer)
    if not np.all(np.isfinite(points)):
        raise InvalidInput("a corner of this polygon is not finite.", pointer)
    shape = shapely.Polygon(points)
    if not shape.is_valid or shape.area < 1e-9:
        why = shapely.is_valid_reason(shape) if not shape.is_valid else "it has no area"
        raise InvalidInput(
            f"this is no simple polygon: {why}. List the corners in order round the outside, none twice.", pointer
        )
    return np.array(shapely.orient_polygons(shape).exterior.coords)[:-1]


def cross(vectors: Floats) -> Floats:
    """Vectors (..., 2) turned by +90°."""
    turned: Floats = np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)
    return turned


def convex_parts(polygon: Floats) -> list[Floats]:
    """A simple polygon (k, 2) as convex ones, counter-clockwise: triangles, merged as long as that stays convex."""
    whole = shapely.Polygon(polygon)
    if _is_convex(whole):
        return [_corners(whole)]
    parts = list(shapely.get_parts(shapely.constrained_delaunay_triangles(whole)))
    corners = [set(part.exterior.coords) for part in parts]
    i, j = 0, 1
    while i < len(parts):
        if j == len(parts):
            i, j = i + 1, i + 2
            continue
        if len(corners[i] & corners[j]) > 1:  # only neighbours can make a convex whole
            both = parts[i].union(parts[j])
            if isinstance(both, shapely.Polygon) and _is_convex(both):
                parts[i], corners[i] = both, set(both.exterior.coords)
                del parts[j], corners[j]
                j = i
        j += 1
    return [_corners(part) for part in parts]


def hull_and_dents(polygon: Floats) -> tuple[Floats, list[Floats]]:
    """Corners of a polygon's hull, counter-clockwise, and the polygons that it has over the polygon."""
    shape = shapely.Polygon(polygon)
    hull = shapely.orient_polygons(shape.convex_hull)
    dents = [
        np.array(shapely.orient_polygons(part).exterior.coords)[:-1]
        for part in shapely.get_parts(hull.difference(shape))
        if isinstance(part, shapely.Polygon) and part.area > 1e-12
    ]
    return np.array(hull.exterior.coords)[:-1], dents


def opened(part: Floats, hull: Floats) -> Floats:
    """A convex part of a dent without the sides it shares with the hull (k, 2): beyond these all is outside anyway.

    So the way out of a dent never leads through its mouth. Returns corners; what is unbounded ends `FAR` away.
    """
    starts, ends = part, np.roll(part, -1, axis=0)
    grown: Floats = FAR * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) + part.mean(axis=0)
    inward = _normals(hull)
    away = np.abs(np.einsum("fa,pa->pf", inward, part) - np.einsum("fa,fa->f", inward, hull))  # of corners from sides
    shared = np.any(np.maximum(away, np.roll(away, -1, axis=0)) < 1e-9, axis=1)
    for start, end, mouth in zip(starts, ends, shared, strict=True):
        if not mouth:
            grown = _clipped(grown, start, cross(end - start))
    return grown


def _clipped(polygon: Floats, point: Floats, normal: Floats) -> Floats:
    """The part of a convex polygon on the side of a line through ``point`` to which ``normal`` points."""
    heights = (polygon - point) @ normal
    corners = []
    for p, h, q, g in zip(polygon, heights, np.roll(polygon, -1, axis=0), np.roll(heights, -1), strict=True):
        if h >= 0.0:
            corners.append(p)
        if h * g < 0.0:
            corners.append(p + h / (h - g) * (q - p))
    return np.array(corners)


def _is_convex(polygon: shapely.Polygon) -> bool:
    return bool(polygon.convex_hull.area - polygon.area <= 1e-9 * polygon.area)


def _corners(polygon: shapely.Polygon) -> Floats:
    """Corners of a convex polygon, those on straight sides left out."""
    hull = shapely.orient_polygons(polygon.convex_hull)
    return np.array(hull.exterior.coords)[:-1]


def polygon_gaps(piece: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Signed distances of convex polygons from a convex piece.

    Args:
        piece: (f, 2) counter-clockwise.
        corners: (k, c, 2) counter-clockwise; one corner is a point.

    Returns:
        (k,) m, negative: depth of the shallowest way out; (k, 2) unit normals from the piece to the polygon, along
        which that distance is measured.
    """
    outward = -_normals(piece)
    over = np.min(np.einsum("kca,fa->kfc", corners, outward), axis=2) - np.einsum("fa,fa->f", outward, piece)
    gaps, normals = over, np.broadcast_to(outward, (len(corners), *outward.shape))
    if corners.shape[1] > 1:
        inward = _normals(corners)
        under = np.einsum("kca,kca->kc", inward, corners)[..., None] - np.einsum("kca,fa->kcf", inward, piece)
        gaps = np.concatenate([gaps, np.min(under, axis=2)], axis=1)
        normals = np.concatenate([normals, inward], axis=1)
    widest = np.argmax(gaps, axis=1)[:, None]
    gap = np.take_along_axis(gaps, widest, axis=1)[:, 0]
    normal: Floats = np.take_along_axis(normals, widest[..., None], axis=1)[:, 0]
    apart = gap > 0.0
    if apart.any():  # no side need face the other where corners are nearest
        gap, normal = gap.copy(), normal.copy()
        gap[apart], normal[apart] = _nearest(piece, corners[apart])
    return gap, normal


def _normals(polygons: Floats) -> Floats:
    """Unit normals to the left of the sides (..., k, 2): inward for counter-clockwise polygons."""
    sides = np.roll(polygons, -1, axis=-2) - polygons
    normals: Floats = cross(sides) / np.linalg.norm(sides, axis=-1, keepdims=True)
    return normals


def _nearest(piece: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Distance (k,) and unit direction (k, 2) from a piece (f, 2) to disjoint polygons (k, c, 2)."""
    to_corner = _to_points(piece[None, :, None], np.roll(piece, -1, axis=0)[None, :, None], corners[:, None])
    ways = to_corner.reshape(len(corners), -1, 2)
    if corners.shape[1] > 1:
        ends = np.roll(corners, -1, axis=1)
        to_piece = -_to_points(corners[:, :, None], ends[:, :, None], piece[None, None])
        ways = np.concatenate([ways, to_piece.reshape(len(corners), -1, 2)], axis=1)
    lengths = np.linalg.norm(ways, axis=-1)
    shortest = np.argmin(lengths, axis=1)[:, None]
    length = np.take_along_axis(lengths, shortest, axis=1)[:, 0]
    way = np.take_along_axis(ways, shortest[..., None], axis=1)[:, 0]
    return length, way / np.maximum(length, 1e-300)[:, None]


def _to_points(starts: Floats, ends: Floats, points: Floats) -> Floats:
    """Shortest vectors from segments to points, broadcast."""
    sides = ends - starts
    share = np.sum((points - starts) * sides, axis=-1) / np.sum(sides * sides, axis=-1)
    vectors: Floats = points - starts - np.clip(share, 0.0, 1.0)[..., None] * sides
    return vectors
