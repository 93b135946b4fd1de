"""Cutting triangles along planes, and which plane to cut along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull as Hull
from scipy.spatial import QhullError

from duocell.models.base.arrays import Floats, Ints

UNIFORM, AT_DENTS = 7, 9
"""Places tried along every axis: spread evenly, and where most dents begin."""
MOST_SCORED = 1200
"""Triangles by which planes are judged: of more, so many drawn at random, the same ones every time."""
BINS = 64
"""Grid on which corners are gathered to estimate a volume, and dents to find where most begin."""
BALANCE = 0.01
"""Of two planes that save as much, the one through the middle."""
REFLEX = 0.1
"""Sine of the angle from which on two triangles count as bent inwards."""


@dataclass(frozen=True, slots=True)
class Cut:
    """A plane and what it is worth.

    Attributes:
        plane: (4,) unit normal and offset.
        score: volume of the two hulls that it leaves, and a little for their difference.
    """

    plane: Floats
    score: float


def best_cut(triangles: Floats) -> Cut | None:
    """The plane that leaves hulls of the least volume, among some across the axes; None if none leaves two solids.

    Args:
        triangles: (f, 3, 3).
    """
    dents = _dents(triangles)
    some = triangles
    if len(triangles) > MOST_SCORED:
        some = triangles[np.random.default_rng(0).permutation(len(triangles))[:MOST_SCORED]]
    best: Cut | None = None
    for axis in _axes(some):
        along = some.reshape(-1, 3) @ axis
        low, high = float(along.min()), float(along.max())
        for place in _places(low, high, dents, axis):
            plane = np.append(axis, -place)
            score = _score(some, plane)
            if score is not None and (best is None or score < best.score * (1.0 - 1e-9)):
                best = Cut(plane, score)
    return best


def cut_apart(triangles: Floats, plane: Floats) -> tuple[Floats, Floats]:
    """Triangles below and above a plane (4,); those across it are cut in up to three."""
    height = triangles @ plane[:3] + plane[3]
    above = height >= 0.0
    count = np.sum(above, axis=1)
    below_parts, above_parts = [triangles[count == 0]], [triangles[count == 3]]
    for alone, lone_parts, other_parts in ((1, above_parts, below_parts), (2, below_parts, above_parts)):
        rows = np.flatnonzero(count == alone)
        if not len(rows):
            continue
        lone = np.argmax(above[rows], axis=1) if alone == 1 else np.argmin(above[rows], axis=1)
        order = (lone[:, None] + np.arange(3)) % 3
        t = np.take_along_axis(triangles[rows], order[..., None], axis=1)
        h = np.take_along_axis(height[rows], order, axis=1)
        shares = h[:, :1] / np.where(h[:, :1] == h[:, 1:], 1.0, h[:, :1] - h[:, 1:])
        on_plane = t[:, :1] + shares[..., None] * (t[:, 1:] - t[:, :1])
        lone_parts.append(np.stack([t[:, 0], on_plane[:, 0], on_plane[:, 1]], axis=1))
        other_parts.append(np.stack([on_plane[:, 0], t[:, 1], t[:, 2]], axis=1))
        other_parts.append(np.stack([on_plane[:, 0], t[:, 2], on_plane[:, 1]], axis=1))
    return np.concatenate(below_parts), np.concatenate(above_parts)


def _axes(triangles: Floats) -> list[Floats]:
    """Unit normals of the planes to try: the axes of the file, and those of the shape where they are others."""
    centred = triangles.reshape(-1, 3) - triangles.reshape(-1, 3).mean(axis=0)
    _, own = np.linalg.eigh(centred.T @ centred)
    axes = list(np.eye(3))
    return axes + [axis for axis in own.T if np.max(np.abs(axis)) < 0.99]


def _dents(triangles: Floats) -> Floats:
    """(d, 4) middles of edges along which two triangles are bent inwards, and how much they weigh."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    size = max(float(np.ptp(triangles.reshape(-1, 3), axis=0).max()), 1e-300)
    keys = np.round(edges / (1e-7 * size)).astype(np.int64).reshape(-1, 6)
    swapped = keys[:, :3] + 0
    order = np.lexsort(np.concatenate([swapped.T, keys[:, 3:].T]))
    back = np.lexsort(np.concatenate([keys[:, 3:].T, swapped.T]))
    ahead_rows, back_rows = keys[order], np.concatenate([keys[:, 3:], keys[:, :3]], axis=1)[back]
    forward, backward = _common(ahead_rows, back_rows)
    first, second = order[forward], back[backward]
    owner = np.tile(np.arange(len(triangles)), 3)
    along = edges[first, 1] - edges[first, 0]
    length = np.linalg.norm(along, axis=1)
    bend = np.sum(np.cross(normals[owner[first]], normals[owner[second]]) * along, axis=1)
    inwards = bend < -REFLEX * np.maximum(length, 1e-300)
    middle = edges[first].mean(axis=1)[inwards]
    return np.column_stack([middle, -bend[inwards]])


def _common(first: Ints, second: Ints) -> tuple[Ints, Ints]:
    """Indices of rows (n, 6) and (n, 6), both sorted, that are equal; of several equal ones the first."""
    kind = np.dtype((np.void, first.dtype.itemsize * first.shape[1]))
    one, other = (np.ascontiguousarray(rows).view(kind).ravel() for rows in (first, second))
    _, ahead, back = np.intersect1d(one, other, return_indices=True)
    return ahead.astype(np.int64), back.astype(np.int64)


def _places(low: float, high: float, dents: Floats, axis: Floats) -> Floats:
    """Where to cut along an axis."""
    width = high - low
    if width <= 0.0:
        return np.zeros(0)
    uniform = low + width * (np.arange(UNIFORM) + 1.0) / (UNIFORM + 1.0)
    along = dents[:, :3] @ axis
    inside = (along > low + 1e-3 * width) & (along < high - 1e-3 * width)
    along, weights = along[inside], dents[inside, 3]
    bins = np.minimum((BINS * (along - low) / width).astype(np.int64), BINS - 1)
    weight = np.bincount(bins, weights, BINS)
    heaviest = np.argsort(-weight, kind="stable")[:AT_DENTS]
    at_dents = [along[bins == b][np.argmax(weights[bins == b])] for b in heaviest if weight[b] > 0.0]
    return np.concatenate([uniform, at_dents])


def _score(triangles: Floats, plane: Floats) -> float | None:
    """See `Cut`; None if a side holds no solid."""
    height = triangles @ plane[:3] + plane[3]
    above = height >= 0.0
    across = np.any(above, axis=1) & ~np.all(above, axis=1)
    t, h = triangles[across], height[across]
    crossing = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        over = (h[:, i] >= 0.0) != (h[:, j] >= 0.0)
        share = h[over, i] / (h[over, i] - h[over, j])
        crossing.append(t[over, i] + share[:, None] * (t[over, j] - t[over, i]))
    shared = np.concatenate(crossing)
    volumes = []
    for side in (above, ~above):
        points = np.concatenate([triangles[side], shared])
        if len(points) < 4:
            return None
        try:
            volumes.append(float(Hull(gathered(points)).volume))
        except QhullError:
            return None
    return sum(volumes) + BALANCE * abs(volumes[0] - volumes[1])


def gathered(points: Floats) -> Floats:
    """A few of many points with nearly the same hull: the outermost in each cell of a grid."""
    if len(points) <= 256:
        return points
    low = points.min(axis=0)
    width = max(float(np.ptp(points, axis=0).max()), 1e-300)
    cells = np.minimum((BINS * (points - low) / width).astype(np.int64), BINS - 1)
    far = -np.linalg.norm(points - points.mean(axis=0), axis=1)
    order = np.lexsort((far, cells @ np.array([1, BINS, BINS * BINS])))
    numbers = (cells @ np.array([1, BINS, BINS * BINS]))[order]
    return points[order[np.flatnonzero(np.diff(numbers, prepend=-1))]]
