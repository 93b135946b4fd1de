"""Which poses of a task are looked at first, what they count for, and how joints go from them to all poses.

Poses are chosen evenly by a measure that is half the share of the way and half the share of the weight: a task that
dwells at one place is looked at there as well as on its way. Nothing depends on the direction in which a segment is
passed, nor on how the world is turned about the vertical: where two poses are equally good, their own geometry decides.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.pose import rotation_about, rotation_angle
from duocell.optimizer.single_arm.redundant.unreduced_problem import UnreducedProblem

METRES_PER_RADIAN = 0.4
"""A turn of a radian counts as much as this way."""
TIE = 1e-9
WHOLE = 2
"""A segment with so few poses more than asked for is looked at whole."""


def travelled(problem: UnreducedProblem, segment: slice) -> Floats:
    """(m_b,) way from the first pose of a segment to each, in radians."""
    rotations, positions = problem.rotations[segment], problem.positions[segment]
    moved = np.linalg.norm(np.diff(positions, axis=0), axis=1) / METRES_PER_RADIAN
    turned = rotation_angle(np.swapaxes(rotations[:-1], 1, 2) @ rotations[1:])
    return np.concatenate([[0.0], np.cumsum(moved + turned)])


def key_poses(problem: UnreducedProblem, per_segment: int) -> Ints:
    """Indices of at most ``per_segment`` poses of every segment: the ends and what is between, or the middle alone."""
    if per_segment == 1:
        wanted = np.array([0.5])
    else:
        wanted = np.linspace(0.0, 1.0, per_segment)
    return np.unique(np.concatenate([_nearest(problem, segment, wanted) for segment in problem.segments]))


def _nearest(problem: UnreducedProblem, segment: slice, wanted: Floats) -> Ints:
    """Indices of the poses of a segment at these shares of the measure."""
    arc, weights = travelled(problem, segment), problem.weights[segment]
    count = len(arc)
    if count <= len(wanted) + WHOLE and len(wanted) > 1:
        return np.arange(segment.start, segment.stop)
    total = float(np.sum(weights))
    weights = weights / total if total > 0.0 else np.full(count, 1.0 / count)
    middles = np.cumsum(weights) - 0.5 * weights
    spread = (middles - middles[0]) / max(middles[-1] - middles[0], TIE)
    share = 0.5 * (arc / arc[-1] + spread) if arc[-1] > TIE else spread
    return np.array([segment.start + _pick(problem, segment, np.abs(share - w)) for w in wanted])


def _pick(problem: UnreducedProblem, segment: slice, distance: Floats) -> int:
    """Index within the segment of the nearest pose; ties are broken by where the pose is, not by its number."""
    tied = np.flatnonzero(distance <= np.min(distance) + TIE)
    if len(tied) == 1:
        return int(tied[0])
    at = tied + segment.start
    positions, upright = problem.positions[at], problem.rotations[at, 2]
    mark = np.linalg.norm(positions, axis=1) + 0.31 * positions[:, 2] + upright @ np.array([0.11, 0.13, 0.17])
    first = np.flatnonzero(mark <= np.min(mark) + TIE)
    return int(tied[first[0]])


def shares(problem: UnreducedProblem, keys: Ints) -> Floats:
    """(m, k) how the joints of every pose follow from those of the keys: linearly along the way of each segment."""
    matrix = np.zeros((len(problem.positions), len(keys)))
    for segment in problem.segments:
        own = np.flatnonzero((keys >= segment.start) & (keys < segment.stop))
        arc = travelled(problem, segment)
        marks = arc[keys[own] - segment.start]
        for number, s in enumerate(arc):
            matrix[segment.start + number, own] = _hat(marks, float(s))
    return matrix


def _hat(marks: Floats, s: float) -> Floats:
    """(k,) shares of the marks (ascending) at ``s``; marks at the same place share alike."""
    here = np.abs(marks - s) <= TIE
    if np.any(here):
        return here / np.sum(here)
    after = int(np.searchsorted(marks, s))
    result = np.zeros(len(marks))
    if after in (0, len(marks)):
        result[min(after, len(marks) - 1)] = 1.0
        return result
    part = (s - marks[after - 1]) / (marks[after] - marks[after - 1])
    result[after - 1], result[after] = 1.0 - part, part
    return result


def reduced_to(problem: UnreducedProblem, keys: Ints) -> UnreducedProblem:
    """The problem with the key poses only, each under the weights of the poses it stands for."""
    weights = problem.weights @ shares(problem, keys)
    return problem.only(keys, weights * (len(keys) / np.sum(weights)))


def partly_moved(anchors: UnreducedProblem, keys: UnreducedProblem, part: float) -> UnreducedProblem:
    """The key poses at a part of the way from the anchor pose of their segment (one anchor per segment)."""
    if part >= 1.0:
        return keys
    segments = np.searchsorted(keys.starts, np.arange(len(keys.positions)), side="right") - 1
    start, first = anchors.positions[segments], anchors.rotations[segments]
    turned = np.array([_part_of(a, b, part) for a, b in zip(first, keys.rotations, strict=True)])
    return keys.moved(turned, start + part * (keys.positions - start))


def _part_of(first: Floats, last: Floats, part: float) -> Floats:
    """(3, 3) rotation at a part of the shortest way between two; at half a turn either way will do."""
    relative = first.T @ last
    angle = float(rotation_angle(relative))
    axis = np.array([relative[2, 1] - relative[1, 2], relative[0, 2] - relative[2, 0], relative[1, 0] - relative[0, 1]])
    if np.linalg.norm(axis) < TIE:
        return first if angle < 1.0 else last
    turned: Floats = first @ rotation_about(axis, part * angle)
    return turned
