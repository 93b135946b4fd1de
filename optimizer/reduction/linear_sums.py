"""Linear limits on paths whose joints are chosen one by one: the turns of 2π, then the yaw, then what is left over.

The limits of single joints leave every joint its cheapest turn by itself. A sum of joints may forbid that turn: then
one joint after the other goes a turn on or back where that takes the sum nearer to its range. This need not be the best
way, where several joints have more than a turn; a bound that does not know of sums stays below it.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.cell.segments import slices
from duocell.models.robot.arm import TURN, Arm
from duocell.models.robot.linear_limits import LinearLimits

ROUNDING = 1e-12
"""rad"""
LEAST = 1e-9
"""rad of a sum, that a turn has to win."""


def sum_excess(arm: Arm, joints: Floats) -> Floats:
    """(...) rad by which paths (n, ..., m) leave the linear limits: the farthest of each path, over all limits."""
    limits = arm.linear_limits
    if limits is None:
        return np.zeros(joints.shape[1:-1])
    return _excess(limits, np.ones(len(limits), dtype=np.bool_), joints)


def keep_sums(arm: Arm, joints: Floats, starts: tuple[int, ...], *, free_yaw: bool) -> None:
    """Give joints of paths (n, ..., m), in place, other turns where linear limits ask for it, segment by segment.

    Where a yaw is chosen afterwards, that is what joint 1 and its sums are for: see `first_joint_limits`.
    """
    limits = arm.linear_limits
    if limits is None or not arm.turns_matter:
        return
    rows: Bools = limits.matrix[:, 0] == 0.0 if free_yaw else np.ones(len(limits), dtype=np.bool_)
    used = np.any(limits.matrix[rows] != 0.0, axis=0) & (arm.upper - arm.lower >= TURN) & ~arm.robot.prismatic
    for segment in slices(starts, joints.shape[-1]):
        part = joints[..., segment]
        for i in np.flatnonzero(used):
            for turn in (TURN, -TURN):
                now, moved = _excess(limits, rows, part), part.copy()
                moved[i] += turn
                low, high = np.min(moved[i], axis=-1), np.max(moved[i], axis=-1)
                inside = (low >= arm.lower[i] - ROUNDING) & (high <= arm.upper[i] + ROUNDING)
                better = inside & (_excess(limits, rows, moved) < now - LEAST)
                part[i] = np.where(better[..., None], moved[i], part[i])


def first_joint_limits(arm: Arm, joints: Floats) -> tuple[float | Floats, float | Floats]:
    """Limits of joint 1 [rad] along paths (n, ..., m): its own, narrowed by linear limits that it is part of.

    Returns:
        Two numbers, or two arrays (..., m).
    """
    limits = arm.linear_limits
    lower: float | Floats = float(arm.lower[0])
    upper: float | Floats = float(arm.upper[0])
    if limits is None:
        return lower, upper
    for row in np.flatnonzero(limits.matrix[:, 0]):
        share = limits.matrix[row, 0]
        rest = np.tensordot(limits.matrix[row, 1:], joints[1:], axes=1)
        ends = (limits.lower[row] - rest) / share, (limits.upper[row] - rest) / share
        lower, upper = np.maximum(lower, np.minimum(*ends)), np.minimum(upper, np.maximum(*ends))
    return lower, upper


def _excess(limits: LinearLimits, rows: Bools, joints: Floats) -> Floats:
    """(...) rad by which paths (n, ..., m) leave some of the limits, added over these."""
    sums = np.tensordot(limits.matrix[rows], joints, axes=1)
    shape = (-1,) + (1,) * (joints.ndim - 1)
    lower, upper = limits.lower[rows].reshape(shape), limits.upper[rows].reshape(shape)
    outside: Floats = np.sum(np.max(np.maximum(np.maximum(lower - sums, sums - upper), 0.0), axis=-1), axis=0)
    return outside
