"""How far a wrist is from its singularity, and the rule that keeps an arm away from it.

Where joint 5 aligns the axes that it turns against each other, one joint of the wrist may take any value and drags
others along: no controller follows a path there. So a pose whose wrist is within
`duocell.models.robot.arm.SINGULAR_WRIST` of its singularity is not usable, unless the arm is told to allow it. The
axes of an arm that is not quite as drawn never align; its wrist is singular where its own axes 4, 5 and 6 lie in one
plane (`duocell.models.kinematics.nominal.singular_fifth`).
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.kinematics.nominal import singular_fifth
from duocell.models.robot.arm import SINGULAR_WRIST, Arm

ROUNDING = 1e-9
"""rad"""


def wrist_distance(singular: float, fifth: Floats) -> Floats:
    """(...) rad in [0, π/2], distance of values of joint 5 (...) [rad] from the nearer singular one.

    Args:
        singular: rad, one of the singular values; see `duocell.models.kinematics.nominal.singular_fifth`.
        fifth: (...) rad.
    """
    distance: Floats = np.abs(fifth - singular)
    if np.max(distance, initial=0.0) > np.pi:
        distance = np.abs(np.remainder(distance + np.pi, 2.0 * np.pi) - np.pi)
    np.subtract(0.5 * np.pi, np.abs(distance - 0.5 * np.pi), out=distance)
    return distance


def wrist_shortfall(arm: Arm, joints: Floats) -> Floats:
    """(...) rad, violation of the wrist's distance on paths (n, ..., m) [rad]; 0 if it is kept at every pose.

    All 0 for arms without postures and for those that allow singularities.
    """
    singular = singular_fifth(arm.robot) if arm.avoid_singularities else None
    if singular is None:
        return np.zeros(joints.shape[1:-1])
    off = joints[4] - singular  # in few passes: this is asked for at every base that is looked at
    np.abs(off, out=off)
    np.subtract(off, 0.5 * np.pi, out=off)
    np.abs(off, out=off)
    farthest = np.max(off, axis=-1, initial=0.0)
    if np.max(farthest, initial=0.0) > 0.5 * np.pi + ROUNDING:  # joint 5 is on other turns
        farthest = 0.5 * np.pi - np.min(wrist_distance(singular, joints[4]), axis=-1, initial=0.5 * np.pi)
    shortfall: Floats = np.maximum(farthest - (0.5 * np.pi - SINGULAR_WRIST + KEPT), 0.0)
    return shortfall
