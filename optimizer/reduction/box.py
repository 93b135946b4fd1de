"""Where a base can stand at all: the allowed region cut down to what every pose leaves within reach."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.base.sampling import even_points
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import ClosedForm, closed_form
from duocell.models.kinematics.kinematics import carriage_ends, reach
from duocell.models.robot.arm import Arm

LEVEL = 1e-4
"""Largest cosine between axes 1 and 2 that counts as nearly a right angle: only then is the arm's plane upright."""
SLACK = 5.0 * KEPT
"""m, so that nothing cuts off a base that just reaches: it may be out of its region, and the hand off its pose and
turned, by as much as counts as kept."""


def reach_windows(cell: Cell, arm: Arm) -> Floats:
    """(m, 3, 2) m: for every pose a box that holds each base position (x, y, z) from which the pose is within reach.

    Sound whatever the joint limits, and whatever the pose leaves open: a base outside is out of reach for sure.
    """
    targets, freedom = cell.flange_targets(arm), cell.freedom(arm)
    point = np.zeros(3)
    form = closed_form(arm.robot)
    level = form is not None and abs(float(form.n @ form.axes[0])) < LEVEL
    if form is not None and level and chain_of(arm.robot).vertical_sign and arm.upright:
        centre = targets[:, :3, 3] + targets[:, :3, :3] @ form.wrist_in_flange
        half, lift = _wrist_reach(form)
        centre, point = centre - np.array([0.0, 0.0, lift]), form.wrist_in_flange
    elif arm.robot.carried is not None and arm.upright:
        half, lift = _carried_reach(arm)
        centre = targets[:, :3, 3] - np.array([0.0, 0.0, lift])
    else:
        centre = targets[:, :3, 3]
        half = np.full(3, reach(arm.robot, _travel(arm)))
    half = half + SLACK
    if not freedom.exact:
        half = half + freedom.moved(point)[:, None]
    return np.stack([centre - half, centre + half], axis=-1)


def _wrist_reach(form: ClosedForm) -> tuple[Floats, float]:
    """Largest distance of W from axis 1 (twice) and from the shoulder's height (3,) m; that height in the base."""
    plane = form.planar
    links = plane.upper + plane.fore + float(np.hypot(*plane.hand))
    across = float(np.hypot(form.offset, abs(plane.shoulder[0]) + links))
    lift = float(form.origin[2] + plane.shoulder[1] * form.up[2])
    lean = 2.0 * abs(float(form.n @ form.axes[0])) * (across + links)  # catalogue data are rounded
    return np.array([across, across, links]) + lean, lift


def _travel(arm: Arm) -> tuple[float, float] | None:
    """The travel of an arm's linear axis [m], with what counts as kept."""
    return None if arm.travel is None else (arm.travel[0] - KEPT, arm.travel[1] + KEPT)


def _carried_reach(arm: Arm) -> tuple[Floats, float]:
    """Largest distance of the flange from the base origin along x, y and z (3,) m, whatever the yaw, the last from a
    height above it, on an upright linear axis; and that height [m], half way between those of its two ends.
    """
    ends, turning = carriage_ends(arm.robot, _travel(arm)), reach(arm.robot.carried or arm.robot)
    across = float(np.max(np.hypot(ends[:, 0], ends[:, 1]))) + turning
    rise = 0.5 * abs(float(ends[1, 2] - ends[0, 2]))
    return np.array([across, across, rise + turning]), float(np.mean(ends[:, 2]))


def search_box(cell: Cell, arm: Arm) -> Floats:
    """(3, 2) m: bounds of x, y, z worth searching; some low > high where no base reaches every pose."""
    windows = reach_windows(cell, arm)
    region = arm.base.bounds[:3]
    low = np.maximum(region[:, 0], np.max(windows[:, :, 0], axis=0))
    high = np.minimum(region[:, 1], np.min(windows[:, :, 1], axis=0))
    return np.stack([low, high], axis=-1)


def spread(box: Floats, count: int, seed: int) -> Floats:
    """(k, d) points spread evenly over a box (d, 2), fixed coordinates kept; a box of one point gives that point."""
    width = box[:, 1] - box[:, 0]
    free = width > 0.0
    dimension = int(np.sum(free))
    if dimension == 0:
        return box[:, 0][None, :].copy()
    points = np.tile(box[:, 0], (count, 1))
    points[:, free] += even_points(dimension, count, seed) * width[free]
    return points
