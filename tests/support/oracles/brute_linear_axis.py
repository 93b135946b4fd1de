"""Brute force for an arm on a linear axis: every base of a grid, every place of the carriage, every branch of the arm.

From one base each pose has a layer of nodes, the closed form's branches from every place of the carriage; the cheapest
path through the layers is found by dynamic programming. It is a layout, so the best one costs no more.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import solve_branches
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.arm import Arm
from tests.support.angles import TURN

EXISTS = 1e-9
"""m that a branch may lack."""


def cheapest(cell: Cell, arm: Arm, bases: Floats, places: Floats) -> tuple[float, Floats | None]:
    """Least objective over bases (K, 4) x, y, z [m], yaw [rad] and places of the carriage (L,) m, and its joints.

    Infinite and None where no base of the grid has a path.
    """
    best: tuple[float, Floats | None] = np.inf, None
    for base in bases:
        found = _from_base(cell, arm, base, places)
        best = found if found[0] < best[0] else best
    return best


def _from_base(cell: Cell, arm: Arm, base: Floats, places: Floats) -> tuple[float, Floats | None]:
    layers = [_nodes(arm, target, places) for target in _seen(cell, arm, base)]
    if not all(map(len, layers)):
        return np.inf, None
    costs = [
        w * np.sum(arm.weights * (q - arm.reference) ** 2, axis=1)
        for q, w in zip(layers, cell.task.weights, strict=True)
    ]
    allowed = cell.step_limits(arm.robot)
    total, back = costs[0], []
    for j, (before, after) in enumerate(pairwise(layers)):
        too_long = np.zeros((len(before), len(after)), dtype=np.bool_)
        if cell.task.joined[j]:
            for i, most in enumerate(allowed):
                too_long |= np.abs(np.subtract.outer(before[:, i], after[:, i])) > most
        ways = np.where(too_long, np.inf, total[:, None])
        back.append(np.argmin(ways, axis=0))
        total = np.min(ways, axis=0) + costs[j + 1]
    if not np.isfinite(np.min(total)):
        return np.inf, None
    chosen = [int(np.argmin(total))]
    for links in reversed(back):
        chosen.append(int(links[chosen[-1]]))
    path = np.array([layer[k] for layer, k in zip(layers, reversed(chosen), strict=True)])
    return float(np.min(total)), path


def _seen(cell: Cell, arm: Arm, base: Floats) -> Floats:
    """(m, 4, 4) flange targets in the base frame."""
    targets: Floats = inverse(arm.base_in_world(base[:3], float(base[3]))) @ cell.flange_targets(arm)
    return targets


def _nodes(arm: Arm, target: Floats, places: Floats) -> Floats:
    """(N, n) joint values inside the limits that take the flange to a pose (4, 4), each turn nearest the reference."""
    robot, carried = arm.robot, arm.robot.carried
    assert carried is not None
    form = closed_form(carried)
    assert form is not None
    start = robot.joint_placements[0]
    shift = np.zeros((len(places), 3)) + start[:3, 3] + places[:, None] * (start[:3, :3] @ robot.joint_axes[0])
    rotation = start[:3, :3].T @ target[:3, :3]
    positions = (target[:3, 3] - shift) @ start[:3, :3]
    found = solve_branches(form, np.broadcast_to(rotation, (len(places), 1, 3, 3)), positions[:, None])
    joints = found.joints[..., 0].reshape(6, -1).T
    nodes = np.column_stack([np.tile(places, 8), joints])[found.missing[..., 0].ravel() < EXISTS]
    nodes[:, 1:] += TURN * np.round((arm.reference[1:] - nodes[:, 1:]) / TURN)
    for turn in (TURN, -TURN):
        outside = nodes < arm.lower if turn > 0.0 else nodes > arm.upper
        nodes[:, 1:] += np.where(outside[:, 1:], turn, 0.0)
    inside: Floats = nodes[np.all((nodes >= arm.lower) & (nodes <= arm.upper), axis=1)]
    return inside
