"""Where the source starts: bases on the normal bisector of the path, one on each side, facing it (section 5).

Example 1 of the source prints starts 627 mm from the middle of its path, with yaws of -45° and 135° where the rule
gives -46.4° and 133.6°; with its printed reaches the distance would be 621 mm, with the corrected ones it is 612 mm.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.arm import Arm, Interval
from duocell.optimizer.baselines.reach import reach_range

LEFT, RIGHT = 1, -1
"""Sides of the path, seen along it from above."""


def source_start(cell: Cell, arm: Arm, side: int) -> Floats:
    """The source's start of one arm on one side of the path.

    ``(Rmin + Rmax) / 2`` from the middle between first and last pose, on the horizontal normal of the path, the base's
    x axis towards it. Components that the request fixes keep their values (the result may then be nearer or farther);
    a free z starts in the middle of its interval. The start may lie outside the allowed region. The path of a task
    sequence, which the source does not know, is taken to go from the first pose of its first segment to the last of its
    last.

    Args:
        cell: the task.
        arm: an arm with a closed form.
        side: `LEFT` or `RIGHT`.

    Returns:
        (4,) x, y, z [m], yaw [rad].

    Raises:
        ValueError: the arm has no closed form, so its reaches are not known.
    """
    form = closed_form(arm.robot)
    if form is None:
        raise ValueError(f"{arm.robot.name} has no closed form")
    positions = cell.task.poses[:, :2, 3]
    middle, along = 0.5 * (positions[0] + positions[-1]), _heading(positions)
    normal = side * np.array([-along[1], along[0]])
    place = middle + 0.5 * sum(reach_range(arm.robot, form)) * normal
    yaw = arm.base.yaw_in_interval(float(np.arctan2(-normal[1], -normal[0])))
    region = arm.base
    return np.array([_kept(region.x, place[0]), _kept(region.y, place[1]), region.z.middle, yaw])


def _kept(interval: Interval, value: float) -> float:
    """``value``, or the fixed value if there is nothing to choose."""
    return interval.low if interval.fixed else float(value)


def _heading(positions: Floats) -> Floats:
    """(2,) unit direction from the first to the last position (m, 2); of the widest spread where these coincide."""
    chord = positions[-1] - positions[0]
    length = float(np.linalg.norm(chord))
    if length > 1e-6:
        return np.asarray(chord / length)
    spread = positions - positions.mean(axis=0)
    if float(np.abs(spread).max()) <= 1e-6:
        return np.array([1.0, 0.0])  # a path on the spot has no direction
    _, _, axes = np.linalg.svd(spread, full_matrices=False)
    return np.asarray(axes[0])
