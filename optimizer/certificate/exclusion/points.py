"""Bodies of moving links against obstacles and the part: points inside of them, moved as far as the box allows."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.optimizer.certificate.exclusion.bodies import Other, Points
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE
from duocell.optimizer.certificate.exclusion.gap import gap
from duocell.optimizer.certificate.exclusion.motion import Motion

DEEPEST = 24
"""Points of a box that are looked at, those deepest in an obstacle at the centre of the box."""


@dataclass(frozen=True, eq=False, slots=True)
class Held:
    """Where the part is.

    Attributes:
        objects: (m, 4, 4) object frame in the world. segments: (m,) number of the segment of every pose.
    """

    objects: Floats
    segments: Ints


def point_slack(
    motion: Motion, points: Points, places: Floats, other: Other, held: Held, level: float, exempt: Bools | None = None
) -> Floats:
    """(N,) m; wherever in a box the base stands, some point keeps no more than this beyond what is required.

    Infinite where nothing is known. What is above ``level`` at the centre of a box is not looked at.

    Args:
        motion: over N boxes. points: of the arm. places: (N, m, P, 3) m, of all points at the centres.
        other: what to keep away from. held: where the part is.
        level: m, slacks of interest.
        exempt: (N, k) True for points of ``other`` that may belong to what is mounted on it.
    """
    slack = np.full(len(motion), np.inf)
    gaps = np.full((len(motion), places.shape[1], len(other.points)), np.inf)
    allowance = points.radius[other.points] + other.required
    for own, frame in other.frames(held.objects, held.segments):
        gaps[:, own] = gap(other.body.shape, frame, places[:, own, other.points]) - allowance
    if exempt is not None:
        gaps = np.where(exempt[:, None], np.inf, gaps)
    box, pose, which = np.nonzero(gaps < level - TOLERANCE)
    if not len(box):
        return slack
    kept = deepest(box, gaps[box, pose, which], DEEPEST)
    box, pose, which = box[kept], pose[kept], which[kept]
    here = gaps[box, pose, which]
    index = other.points[which]
    ball, gradient, rest = motion.linear(box, pose, places[box, pose, index], points.link[index])
    most = here + ball
    some = np.flatnonzero(here + rest < np.minimum(most, level))
    if len(some):
        corners = places[box[some], pose[some], index[some], None] + _steps(motion.half[box[some]], gradient[some])
        farthest = _at_corners(other, held, pose[some], corners) - allowance[which[some]] + rest[some]
        most[some] = np.fmin(most[some], farthest)
    np.fmin.at(slack, box, most)
    return slack


def _steps(half: Floats, gradient: Floats) -> Floats:
    """(q, 2^K, 3) m, how points with slopes (q, 3, K) are moved from the centres of boxes (q, K) to their corners."""
    corners = np.array(list(product((-1.0, 1.0), repeat=half.shape[1])))
    steps: Floats = np.einsum("qaK,qK,vK->qva", gradient, half, corners)
    return steps


def _at_corners(other: Other, held: Held, poses: Ints, places: Floats) -> Floats:
    """(q,) m, the largest distance of places (q, v, 3) from a body at poses (q,)."""
    if not other.part:
        return np.asarray(np.max(gap(other.body.shape, other.body.pose, places), axis=1))
    farthest = np.empty(len(poses))
    for pose in np.unique(poses):
        here = poses == pose
        frame = held.objects[pose] @ other.body.pose
        farthest[here] = np.max(gap(other.body.shape, frame, places[here]), axis=1)
    return farthest


def deepest(owner: Ints, values: Floats, most: int) -> Ints:
    """Indices of entries (q,): of every owner the ``most`` with the smallest values, owners in ascending order."""
    order = np.lexsort((values, owner))
    owners = owner[order]
    rank = np.arange(len(owners)) - np.searchsorted(owners, owners, side="left")
    return np.asarray(order[rank < most])
