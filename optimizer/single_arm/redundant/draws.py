"""Seeds for one pose: of many postures, those whose flange fits the target best from some allowed base.

For a posture the best base is known in closed form: the yaw that turns the flange as nearly as possible as the target
is turned, then the position that brings it there, clipped to the region. Forward kinematics is all that is needed.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.sampling import even_points
from duocell.models.kinematics.branches import signs_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.arm import TURN
from duocell.models.robot.posture import signs_from
from duocell.optimizer.single_arm.redundant.key_poses import METRES_PER_RADIAN
from duocell.optimizer.single_arm.redundant.unreduced_problem import UnreducedProblem


def posture_ranges(problem: UnreducedProblem) -> tuple[Floats, Floats]:
    """(n,) rad or m, limits, those of joints that turn cut to half a turn about the reference."""
    reference = problem.arm.reference
    low, high = np.maximum(problem.lower, reference - np.pi), np.minimum(problem.upper, reference + np.pi)
    empty = (low >= high) | (problem.turns == 0.0)  # a reference outside of the limits, or no angle
    return np.where(empty, problem.lower, low), np.where(empty, problem.upper, high)


def drawn_postures(problem: UnreducedProblem, count: int, seed: int) -> Floats:
    """(n, count) rad, spread evenly over the limits; fewer where the arm insists on a posture."""
    low, high = posture_ranges(problem)
    q = (low + (high - low) * even_points(problem.dof, count, seed + 1)).T
    form = closed_form(problem.arm.robot)
    if form is None or problem.arm.posture.free:
        return q
    return q[:, [problem.arm.posture.admits(signs_from(signs)) for signs in signs_of(form, q.T)]]


def draw_seeds(problem: UnreducedProblem, pose: int, count: int, drawn: int, seed: int) -> tuple[Floats, Floats]:
    """Postures (n, K) and bases (K, 4) for one pose, the best K <= count of ``drawn`` postures."""
    q = drawn_postures(problem, drawn, seed)
    columns, flange = problem.chain.forward(q)
    target = problem.rotations[pose]
    overlap = _overlap(columns, target)
    yaw = np.arctan2(overlap[0, 1] - overlap[1, 0], overlap[0, 0] + overlap[1, 1])
    low, high = problem.base_lower[3], problem.base_upper[3]
    if not problem.arm.base.yaw_free:
        middle = 0.5 * (low + high)
        yaw = np.clip(middle + np.mod(yaw - middle + np.pi, TURN) - np.pi, low, high)
    angle = _angle(overlap, yaw)
    wanted = problem.positions[pose] - _turned(flange, yaw) @ problem.arm.mount.T
    position = np.clip(wanted, problem.base_lower[:3], problem.base_upper[:3])
    miss = angle + np.linalg.norm(wanted - position, axis=1) / METRES_PER_RADIAN
    best = _best(miss, count)
    return q[:, best], np.column_stack([position, yaw])[best]


def fit_to_bases(problem: UnreducedProblem, pose: int, bases: Floats, q: Floats, count: int) -> Floats:
    """(n, count, K) the postures of (n, D) that fit one pose best, for every base (K, 4)."""
    columns, flange = problem.chain.forward(q)
    overlap = _overlap(columns, problem.rotations[pose])
    cos, sin = np.cos(bases[:, 3, None]), np.sin(bases[:, 3, None])
    trace = cos * (overlap[0, 0] + overlap[1, 1]) + sin * (overlap[0, 1] - overlap[1, 0]) + overlap[2, 2]
    angle = np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))
    wanted = (problem.positions[pose] - bases[:, :3]) @ problem.arm.mount
    x = cos[:, 0] * wanted[:, 0] + sin[:, 0] * wanted[:, 1]
    y = cos[:, 0] * wanted[:, 1] - sin[:, 0] * wanted[:, 0]
    seen = np.stack([x, y, wanted[:, 2]])
    square = np.sum(seen**2, axis=0)[:, None] + np.sum(flange**2, axis=0) - 2.0 * seen.T @ flange
    miss = angle + np.sqrt(np.maximum(square, 0.0)) / METRES_PER_RADIAN
    chosen = np.argpartition(miss, count - 1, axis=1)[:, :count] if count < q.shape[1] else _all(miss)
    return np.swapaxes(q[:, chosen], 1, 2)


def _all(miss: Floats) -> Ints:
    return np.tile(np.arange(miss.shape[1]), (len(miss), 1))


def _best(miss: Floats, count: int) -> Ints:
    """Indices of the smallest, in ascending order of index."""
    if count >= len(miss):
        return np.arange(len(miss))
    return np.sort(np.argpartition(miss, count - 1)[:count])


def _overlap(columns: Floats, target: Floats) -> Floats:
    """(3, 3, N) flange rotations times the transposed target."""
    overlap: Floats = np.einsum("can,bc->abn", columns, target)
    return overlap


def _angle(overlap: Floats, yaw: Floats) -> Floats:
    """(N,) rad between flange and target with the base turned by ``yaw``."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    trace = cos * (overlap[0, 0] + overlap[1, 1]) + sin * (overlap[0, 1] - overlap[1, 0]) + overlap[2, 2]
    angle: Floats = np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))
    return angle


def _turned(vectors: Floats, yaw: Floats) -> Floats:
    """(N, 3) vectors (3, N) turned about z."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.column_stack([cos * vectors[0] - sin * vectors[1], sin * vectors[0] + cos * vectors[1], vectors[2]])
