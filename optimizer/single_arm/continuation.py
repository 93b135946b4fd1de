"""Paths of one arm by continuation from many seeds at once: for arms whose branches are dear to enumerate.

Every seed is a base, drawn from the search box, and a posture, drawn from the limits. Newton's method takes the
posture to the middle pose of the task, and on from pose to pose to both ends; a redundant arm's self-motion is
drawn towards the reference on the way. All seeds move together, so a hundred paths cost little more than one.

From one segment of a task sequence to the next there is no way to follow: Newton's method starts anew at the middle of
the segment, from the posture it had in the segment before, or else from the reference or another draw.
"""

from __future__ import annotations

import time

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.pose import inverse
from duocell.models.base.sampling import even_points
from duocell.models.cell.cell import Cell
from duocell.models.cell.pose_freedom import EQUATIONS
from duocell.models.kinematics.batch_kinematics import forward_and_jacobian, pose_error
from duocell.models.kinematics.chain import Chain, chain_of
from duocell.models.robot.arm import Arm
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.reduction.box import spread
from duocell.optimizer.reduction.layers import LayeredPath, finish_path

FIRST_ITERATIONS = 20
NEXT_ITERATIONS = 8
FAR_ITERATIONS = 30
REACHED = 1e-6
"""m and rad; the local solver does the rest."""
PULL = 0.3
"""Share of the way to the reference that self-motion goes in one iteration."""


def continue_paths(
    cell: Cell, arm: Arm, region: Floats, seed: int, count: int, deadline: float = np.inf
) -> list[LayeredPath]:
    """Paths from ``count`` seeds, those that reach every pose.

    Args:
        cell: task and step limit.
        arm: the arm.
        region: (4, 2) bounds of x, y, z [m] and yaw [rad] to draw bases from.
        seed: of the draws.
        count: how many.
        deadline: `time.perf_counter` value; nothing is returned if it passes on the way.
    """
    places = spread(region, count, seed)
    if len(places) < count:
        places = np.repeat(places, count, axis=0)
    chain = chain_of(arm.robot)
    flange_in_world = cell.flange_targets(arm)
    segments = cell.task.segments
    middles = [(segment.start + segment.stop) // 2 for segment in segments]
    draws = _postures(arm, count, seed)
    start, places = _settle(chain, arm, flange_in_world[middles[0]], draws, places, region)
    bases = arm.base_in_world(places[:, :3], places[:, 3])
    targets = np.einsum("kab,jbc->jkac", inverse(bases), flange_in_world)  # (m, K, 4, 4)
    path = np.empty((len(targets), count, arm.dof))
    alive: Bools = np.ones(count, dtype=np.bool_)
    for segment, middle in zip(segments, middles, strict=True):
        if segment.start == 0:
            start, reached = _reach(chain, arm, targets[middle], start, NEXT_ITERATIONS)
        else:
            tries = [start, np.broadcast_to(arm.reference, start.shape), draws]
            start, reached = _reach_anew(chain, arm, targets[middle], tries)
        alive &= reached
        path[middle] = start
        for order in (range(middle + 1, segment.stop), range(middle - 1, segment.start - 1, -1)):
            q = start
            for j in order:
                check_stop()
                if time.perf_counter() > deadline:
                    return []
                q, reached = _reach(chain, arm, targets[j], q, NEXT_ITERATIONS)
                path[j] = q
                alive &= reached
    return [
        finish_path(cell, arm, places[k, :3], float(places[k, 3]), path[:, k].T.copy()) for k in np.flatnonzero(alive)
    ]


def _settle(chain: Chain, arm: Arm, target: Floats, q: Floats, places: Floats, region: Floats) -> tuple[Floats, Floats]:
    """Bring postures (K, n) to one pose (4, 4) in the world, moving the bases (K, 4) inside the region as well."""
    turned = arm.base_in_world(places[:, :3], places[:, 3])[:, :3, :3]
    inside = np.swapaxes(turned, 1, 2)
    places = places.copy()
    for _ in range(FIRST_ITERATIONS):
        rotations, positions, jacobians = forward_and_jacobian(chain, q)
        wanted = np.zeros((len(q), 4, 4))
        wanted[:, :3, :3] = inside @ target[:3, :3]
        wanted[:, :3, 3] = np.einsum("kab,kb->ka", inside, target[:3, 3] - places[:, :3])
        error = pose_error(rotations, positions, wanted)
        free = (region[:3, 1] > region[:3, 0]).astype(np.float64)
        base = np.concatenate([inside * free, np.zeros((len(q), 3, 3))], axis=1)
        columns = np.concatenate([jacobians, base], axis=2)
        transposed = np.swapaxes(columns, 1, 2)
        damping = np.minimum(1e-2, np.max(np.abs(error), axis=1) ** 2)[:, None, None] + 1e-12
        step = (transposed @ np.linalg.solve(columns @ transposed + damping * np.eye(6), error[..., None]))[..., 0]
        step *= np.minimum(1.0, 0.5 / np.maximum(np.max(np.abs(step), axis=1, keepdims=True), 1e-300))
        q = q + step[:, :-3]
        places[:, :3] = np.clip(places[:, :3] + step[:, -3:], region[:3, 0], region[:3, 1])
    return q, places


def _postures(arm: Arm, count: int, seed: int) -> Floats:
    """(K, n) postures spread over the limits; joints without end over one turn."""
    low = np.where(np.isfinite(arm.lower), arm.lower, -np.pi)
    high = np.where(np.isfinite(arm.upper), arm.upper, np.pi)
    draws: Floats = low + (high - low) * even_points(arm.dof, count, seed + 1)
    return draws


def _reach_anew(chain: Chain, arm: Arm, targets: Floats, tries: list[Floats]) -> tuple[Floats, Bools]:
    """As `_reach` from far: the first of several starts (K, n) that arrives."""
    found, arrived = _reach(chain, arm, targets, tries[0], FAR_ITERATIONS)
    for start in tries[1:]:
        if np.all(arrived):
            break
        q, reached = _reach(chain, arm, targets[~arrived], start[~arrived], FAR_ITERATIONS)
        found[~arrived] = q
        arrived[~arrived] = reached
    return found, arrived


def _reach(chain: Chain, arm: Arm, targets: Floats, q: Floats, iterations: int) -> tuple[Floats, Bools]:
    """Damped Newton steps to ``targets`` (K, 4, 4) from ``q`` (K, n); which of them arrived."""
    redundant = arm.dof > EQUATIONS
    identity = np.eye(arm.dof)
    for _ in range(iterations):
        rotations, positions, jacobians = forward_and_jacobian(chain, q)
        error = pose_error(rotations, positions, targets)
        size = np.max(np.abs(error), axis=1)
        if not redundant and np.all(size < REACHED):
            break
        transposed = np.swapaxes(jacobians, 1, 2)
        damping = np.minimum(1e-2, size**2)[:, None, None] + 1e-12
        pseudo = transposed @ np.linalg.inv(jacobians @ transposed + damping * np.eye(6))
        step = (pseudo @ error[..., None])[..., 0]
        if redundant:
            wish = PULL * np.sign(arm.weights) * (arm.reference - q)
            step += ((identity - pseudo @ jacobians) @ wish[..., None])[..., 0]
        q = q + step * np.minimum(1.0, 0.5 / np.maximum(np.max(np.abs(step), axis=1, keepdims=True), 1e-300))
    rotations, positions, _ = forward_and_jacobian(chain, q)
    arrived: Bools = np.max(np.abs(pose_error(rotations, positions, targets)), axis=1) < 100.0 * REACHED
    return q, arrived
