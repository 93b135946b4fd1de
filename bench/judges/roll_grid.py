"""A free roll by brute force: every base, yaw, roll and posture of a grid, and a shortest path through the poses.

It shares the closed form of the inverse kinematics with the product and nothing else: bases and yaws stand on a grid,
every pose takes one of its rolls, and consecutive poses are at most the largest joint step apart. What it finds is a
layout, so its cost is above the least one, by what the grid is coarse. The cost, joint availability, is written out
here once more, so that a mistake in the product's would show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import solve_branches
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.objective.objective import JOINT_AVAILABILITY
from duocell.models.robot.arm import SINGULAR_WRIST, TURN
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.nlp.program import ArmSolution

BASES, YAWS, ROLLS = 21, 24, 36
"""Along each side of the region, and around."""
TRIED = 400
"""Bases, yaws and postures whose shortest paths are looked for, those first that cost least without limits on steps."""
EXISTS = 1e-9
"""m"""


@dataclass(frozen=True, eq=False)
class OnGrid:
    """The best of the grid: its cost and where it is; infinite and None where nothing of the grid is allowed."""

    objective: float
    point: ArmSolution | None


def best_on_grid(cell: Cell, bases: int = BASES, yaws: int = YAWS, rolls: int = ROLLS) -> OnGrid:
    """The best of a grid for the only arm of a cell, whose roll about z of its TCP is free at every pose."""
    arm = cell.arms[0]
    if cell.objective != JOINT_AVAILABILITY:
        raise ValueError(f"the grid is searched for joint availability, not for {cell.objective.name}")
    form, sigma = closed_form(arm.robot), chain_of(arm.robot).vertical_sign
    if form is None or sigma == 0:
        raise ValueError(f"{arm.robot.name} has no reduction")
    sides = [np.linspace(side.low, side.high, bases) for side in (arm.base.x, arm.base.y)]
    places = np.stack([*np.meshgrid(*sides, indexing="ij"), np.full((bases, bases), arm.base.z.low)], -1).reshape(-1, 3)
    roll = TURN * np.arange(rolls) / rolls
    turned = transform(rotation_z(roll), np.zeros(3))
    hands = cell.task.poses @ arm.grasp
    flanges = hands[:, None] @ turned @ inverse(arm.tool)  # (m, R, 4, 4)
    m = len(hands)
    seen = flanges.reshape(-1, 4, 4)[:, :3, 3] - places[:, None]
    found = solve_branches(form, flanges.reshape(-1, 4, 4)[:, :3, :3], seen)
    joints = np.moveaxis(found.joints.reshape(6, 8, len(places), m, rolls), 0, -1)  # (8, N, m, R, 6)
    exists = found.missing.reshape(joints.shape[:-1]) < EXISTS
    exists &= np.abs(np.sin(joints[..., 4] - form.wrist_zero)) > SINGULAR_WRIST
    wound = _wound(joints, arm.lower, arm.upper, arm.reference)
    inside = np.all((wound >= arm.lower) & (wound <= arm.upper) | (np.arange(6) == 0), axis=-1) & exists
    cost = np.sum((arm.weights * (wound - arm.reference) ** 2)[..., 1:], axis=-1)
    cost = np.where(inside, cost, np.inf)
    least = []
    for yaw in TURN * np.arange(yaws) / yaws:
        first = _wound(joints[..., :1] - sigma * yaw, arm.lower[:1], arm.upper[:1], arm.reference[:1])[..., 0]
        allowed = (first >= arm.lower[0]) & (first <= arm.upper[0])
        every = np.where(allowed, cost + arm.weights[0] * (first - arm.reference[0]) ** 2, np.inf)
        least.append(np.sum(np.min(every, axis=-1), axis=-1))
    bound = np.stack(least)  # (Y, 8, N)
    best = OnGrid(np.inf, None)
    for index in np.argsort(bound, axis=None, kind="stable")[:TRIED]:
        y, k, n = (int(i) for i in np.unravel_index(index, bound.shape))
        if bound[y, k, n] >= best.objective:
            break
        yaw = float(TURN * y / yaws)
        q = wound[k, n].copy()
        q[..., :1] = _wound(joints[k, n, ..., :1] - sigma * yaw, arm.lower[:1], arm.upper[:1], arm.reference[:1])
        there = cost[k, n] + arm.weights[0] * (q[..., 0] - arm.reference[0]) ** 2
        there = np.where((q[..., 0] >= arm.lower[0]) & (q[..., 0] <= arm.upper[0]), there, np.inf)
        value, chosen = _shortest(q, there, cell.max_joint_step)
        if value < best.objective:
            path = q[np.arange(m), chosen]
            free = np.unwrap(roll[chosen])[:, None]
            best = OnGrid(value, ArmSolution(places[n], yaw, path, ALL_SIGNS[k], free))
    return best


def _wound(joints: Floats, lower: Floats, upper: Floats, reference: Floats) -> Floats:
    """Joints on the turn nearest to their reference, or the next one that is inside the limits."""
    wound = joints + TURN * np.round((reference - joints) / TURN)
    wound = np.where(wound < lower, wound + TURN, wound)
    turned: Floats = np.where(wound > upper, wound - TURN, wound)
    return turned


def _shortest(q: Floats, cost: Floats, most: float) -> tuple[float, list[int]]:
    """Cost and choices of the cheapest way through the poses (m, R), joints (m, R, 6) changing by at most ``most``."""
    total, back = cost[0], []
    for j in range(1, len(q)):
        steps = np.max(np.abs(q[j][None] - q[j - 1][:, None]), axis=-1)
        ways = np.where(steps <= most, total[:, None], np.inf)
        back.append(np.argmin(ways, axis=0))
        total = np.min(ways, axis=0) + cost[j]
    chosen = [int(np.argmin(total))]
    for best in reversed(back):
        chosen.append(int(best[chosen[-1]]))
    return float(np.min(total)), chosen[::-1]
