"""How far hands are outside of what their poses leave open, from where the joints take them, by plain formulas.

The displacement that a hand has made is taken apart again: the tilt is the shortest turn that takes the z axis where it
is, the turns about x, y and z are the Tait-Bryan angles of what is left. Nothing of the search is used.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.cell.pose_freedom import PoseFreedom
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import TURN, Arm
from duocell.models.robot.freedom import LENGTHS, SIZE, TILT
from duocell.optimizer.nlp.program import ArmSolution

TILTED = 3
"""Column of the tilt of the z axis [rad]."""


def parameters_of(freedom: PoseFreedom, flanges: Floats) -> Floats:
    """(m, 8) the displacements of flanges (m, 4, 4) in the world: m, then rad; column 3 is the tilt as one angle.

    Of a task that has a cone, the tilt is taken off first; without one, it is 0, and turns are about x, y and z.
    """
    moved = inverse(freedom.before) @ flanges @ inverse(freedom.after)
    turn, found = moved[:, :3, :3], np.zeros((len(moved), SIZE))
    found[:, :LENGTHS] = moved[:, :3, 3]
    if np.any(np.isin(freedom.which, np.arange(SIZE)[TILT])):
        axis = turn[:, :, 2]
        found[:, TILTED] = np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2])
        turn = _tilts(axis).swapaxes(1, 2) @ turn
    found[:, 5] = np.arctan2(-turn[:, 1, 2], turn[:, 2, 2])
    found[:, 6] = np.arctan2(turn[:, 0, 2], np.hypot(turn[:, 1, 2], turn[:, 2, 2]))
    found[:, 7] = np.arctan2(-turn[:, 0, 1], turn[:, 0, 0])
    return found


def _tilts(axes: Floats) -> Floats:
    """(m, 3, 3) shortest turns that take z to unit axes (m, 3): I + [v]× + [v]×² / (1 + c), v = z × a, c = z · a."""
    x, y, c = axes.T
    zero = np.zeros_like(x)
    rows = ((zero, zero, x), (zero, zero, y), (-x, -y, zero))
    cross = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    tilts: Floats = np.eye(3) + cross + cross @ cross / np.maximum(1.0 + c, 1e-12)[:, None, None]
    return tilts


def tolerance_excess(cell: Cell, arm: Arm, point: ArmSolution) -> float:
    """m or rad by which the worst pose of an arm lies outside of what is open there; 0 but for rounding if none does.

    Args:
        cell: task, as it was asked for. arm: of the cell. point: base and joints.
    """
    freedom = cell.freedom(arm)
    if freedom.exact:
        return 0.0
    flanges = arm.base_in_world(point.position, point.yaw) @ flange_poses(arm.robot, point.joints)
    found = parameters_of(freedom, flanges)
    lower, upper = freedom.given.copy(), freedom.given.copy()
    lower[:, freedom.which], upper[:, freedom.which] = freedom.lower, freedom.upper
    lower[:, TILT], upper[:, TILT] = 0.0, 0.0
    if np.any(np.isin(freedom.which, np.arange(SIZE)[TILT])):
        upper[:, TILTED] = freedom.cone
    whole = np.isinf(upper - lower)
    middle = np.where(whole, 0.0, 0.5 * (lower + np.where(whole, lower, upper)))
    found[:, LENGTHS + 2 :] += TURN * np.round((middle - found)[:, LENGTHS + 2 :] / TURN)
    excess = np.where(whole, -np.inf, np.maximum(lower - found, found - upper))
    return float(np.max(excess))
