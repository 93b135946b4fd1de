"""Further base yaws, for objectives that the yaw in closed form does not suit."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.objective.objective import Objective
from duocell.models.robot.arm import ROUNDING, TURN, Arm

YAWS = 24
"""Shares of a turn; the local solver goes on from the best."""


def take_better_yaws(
    objective: Objective,
    arm: Arm,
    joints: Floats,
    yaw: Floats,
    first_limits: tuple[float | Floats, float | Floats],
    sigma: int,
    counts: Floats | None,
) -> tuple[Floats, Floats]:
    """Turn bases under their arms where that lowers the objective and nothing is left that is inside its limits.

    Args:
        objective: of the cell.
        arm: the arm.
        joints: (n, ..., m) rad, paths; joint 1 is changed in place.
        yaw: (...) rad, of their bases.
        first_limits: rad, of joint 1, as `duocell.optimizer.reduction.paths.choose_yaw` takes them.
        sigma: sense of joint 1 about the vertical, ±1.
        counts: (m,) what the poses count for; None for 1.

    Returns:
        yaw (...) in the allowed interval, and the objective (...) there.
    """
    best, region = objective.of_paths(arm, joints, counts), arm.base.yaw
    first, low, high = joints[0].copy(), *first_limits
    yaws = yaw.copy()
    for turn in TURN / YAWS * np.arange(1 - YAWS, YAWS):
        turned = region.low + np.mod(yaw - sigma * turn - region.low, TURN)
        inside = np.all((first + turn >= low) & (first + turn <= high), axis=-1)
        inside &= turned <= region.high + ROUNDING
        if not np.any(inside):
            continue
        trial = joints.copy()
        trial[0] = first + turn
        cost = objective.of_paths(arm, trial, counts)
        better = inside & (cost < best)
        best, yaws = np.where(better, cost, best), np.where(better, turned, yaws)
        joints[0] = np.where(better[..., None], trial[0], joints[0])
    return yaws, best
