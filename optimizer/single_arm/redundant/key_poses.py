"""Which poses of a task are looked at first, what they count for, and how joints go from them to all poses.

Poses are chosen evenly by a measure that is half the share of the way and half the share of the weight: a task that
dwells at one place is looked at there as well as on its way. Nothing depends on the direction in which a job is passed,
nor on how the world is turned about the vertical: where two poses are equally good, their own geometry decides.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.pose import rotation_about, rotation_angle
from duocell.optimizer.single_arm.redundant.unreduced_problem import UnreducedProblem

METRES_PER_RADIAN = 0.4
"""A turn of a radian counts as much as this way."""
TIE = 1e-9
SPARED = 2
"""A job with so few poses more than asked for is looked at whole."""


def travelled(problem: UnreducedProblem, job: slice) -> Floats:
    """(m_b,) way from the first pose of a job to each, in radians."""
    rotations, positions = problem.rotations[job], problem.positions[job]
    moved = np.linalg.norm(np.diff(positions, axis=0), axis=1) / METRES_PER_RADIAN
    turned = rotation_angle(np.swapaxes(rotations[:-1], 1, 2) @ rotations[1:])
    return np.concatenate([[0.0], np.cumsum(moved + turned)])


def key_poses(problem: UnreducedProblem, per_job: int) -> Ints:
    """Indices of at most ``per_job`` poses of every job: the ends and what is between, or the middle alone."""
    if per_job == 1:
        wanted = np.array([0.5])
    else:
        wanted = np.linspace(0.0, 1.0, per_job)
    return np.unique(np.concatenate([_nearest(problem, job, wanted) for job in problem.jobs]))


def _nearest(problem: UnreducedProblem, job: slice, wanted: Floats) -> Ints:
    """Indices of the poses of a job at these shares of the measure."""
    way, weights = travelled(problem, job), problem.weights[job]
    count = len(way)
    if count <= len(wanted) + SPARED and len(wanted) > 1:
        return np.arange(job.start, job.stop)
    total = float(np.sum(weights))
    weights = weights / total if total > 0.0 else np.full(count, 1.0 / count)
    middles = np.cumsum(weights) - 0.5 * weights
    spread = (middles - middles[0]) / max(middles[-1] - middles[0], TIE)
    share = 0.5 * (way / way[-1] + spread) if way[-1] > TIE else spread
    return np.array([job.start + _pick(problem, job, np.abs(share - w)) for w in wanted])


def _pick(problem: UnreducedProblem, job: slice, distance: Floats) -> int:
    """Index within the job of the nearest pose; ties are broken by where the pose is, not by its number."""
    tied = np.flatnonzero(distance <= np.min(distance) + TIE)
    if len(tied) == 1:
        return int(tied[0])
    at = tied + job.start
    positions, upright = problem.positions[at], problem.rotations[at, 2]
    mark = np.linalg.norm(positions, axis=1) + 0.31 * positions[:, 2] + upright @ np.array([0.11, 0.13, 0.17])
    first = np.flatnonzero(mark <= np.min(mark) + TIE)
    return int(tied[first[0]])


def shares(problem: UnreducedProblem, keys: Ints) -> Floats:
    """(m, k) how the joints of every pose follow from those of the keys: linearly along the way of each job."""
    matrix = np.zeros((len(problem.positions), len(keys)))
    for job in problem.jobs:
        own = np.flatnonzero((keys >= job.start) & (keys < job.stop))
        way = travelled(problem, job)
        marks = way[keys[own] - job.start]
        for number, s in enumerate(way):
            matrix[job.start + number, own] = _hat(marks, float(s))
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


def on_the_way(anchors: UnreducedProblem, keys: UnreducedProblem, part: float) -> UnreducedProblem:
    """The key poses at a part of the way from the anchor pose of their job (one anchor per job)."""
    if part >= 1.0:
        return keys
    jobs = np.searchsorted(keys.starts, np.arange(len(keys.positions)), side="right") - 1
    start, first = anchors.positions[jobs], anchors.rotations[jobs]
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
