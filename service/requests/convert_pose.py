"""Poses of a request as 4x4 transforms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import radians
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRotation
from duocell.models.base.pose import (
    rotation_from_abc_deg,
    rotation_from_axis_angle,
    rotation_from_euler_zyz,
    rotation_from_matrix,
    rotation_from_oat,
    rotation_from_quaternion,
    rotation_from_quaternion_wxyz,
    rotation_from_rpy,
    rotation_from_wpr_deg,
    transform,
)
from duocell.models.robot.arm import TURN
from duocell.service.common.issues import IssueCollector
from duocell.service.schemas.pose import Orientations, Pose, PoseList

MOST = 2.0
"""Turns."""
ROTATIONS: dict[str, Callable[[ArrayLike], Floats]] = {
    "quaternion": rotation_from_quaternion,
    "matrix": rotation_from_matrix,
    "rpy": rotation_from_rpy,
    "euler_zyz": rotation_from_euler_zyz,
    "oat": rotation_from_oat,
    "quaternion_wxyz": rotation_from_quaternion_wxyz,
    "axis_angle": rotation_from_axis_angle,
    "abc_deg": rotation_from_abc_deg,
    "wpr_deg": rotation_from_wpr_deg,
}
"""Conversion of each format, for one rotation or a stack of them."""
ANGLES = ("rpy", "euler_zyz", "oat", "axis_angle")
"""In radians."""
DEGREES = ("abc_deg", "wpr_deg")


def pose_of(pose: Pose, pointer: str, issues: IssueCollector) -> Floats:
    """(4, 4) transform; the identity where an issue had to be noted."""
    ((name, values),) = pose.orientation.model_dump().items()
    result: Floats = np.eye(4)
    rotation = _rotation(name, values, f"{pointer}/orientation", issues)
    return result if rotation is None else transform(rotation, pose.position)


def poses_of(poses: PoseList, pointer: str, issues: IssueCollector) -> Floats | None:
    """(m, 4, 4) transforms of a list of poses; None where issues had to be noted."""
    rotations = np.empty((len(poses), 3, 3))
    for some in poses.orientations:
        converted = _all_at_once(some)
        if converted is None:
            for index, (name, values) in enumerate(poses.one_by_one()):
                _rotation(name, values, f"{pointer}/{index}/orientation", issues)
            return None
        rotations[some.rows] = converted
    return transform(rotations, poses.positions)


def check_radians(angles: Sequence[float], pointer: str, issues: IssueCollector) -> None:
    """Note angles beyond `MOST` turns: nobody means them, they are degrees."""
    worst = max(angles, key=abs)
    if abs(worst) > MOST * TURN:
        issues.add(
            pointer,
            f"{worst:g} rad is more than {MOST:g} turns; angles are in radians. If degrees were meant: "
            f"{worst:g}° is {radians(worst):.6g} rad.",
        )


def _check_degrees(angles: Sequence[float], pointer: str, issues: IssueCollector) -> None:
    """Note angles beyond `MOST` turns: no controller writes them."""
    worst = max(angles, key=abs)
    if abs(worst) > MOST * 360.0:
        issues.add(
            pointer, f"{worst:g}° is more than {MOST:g} turns; no controller writes such angles. Correct the number."
        )


def _rotation(name: str, values: Any, pointer: str, issues: IssueCollector) -> Floats | None:
    """(3, 3) rotation in a format; None where the models refuse it."""
    place = f"{pointer}/{name}"
    if name in ANGLES:
        check_radians(values, place, issues)
    if name in DEGREES:
        _check_degrees(values, place, issues)
    with issues.at(place):
        return ROTATIONS[name](values)
    return None


def _all_at_once(some: Orientations) -> Floats | None:
    """(k, 3, 3), converted together: one by one takes forty times as long. None if any is wrong."""
    if np.abs(some.values).max() > _largest(some.format):
        return None
    try:
        return ROTATIONS[some.format](some.values)
    except InvalidRotation:
        return None


def _largest(name: str) -> float:
    """Of the numbers of a format."""
    if name in ANGLES:
        return MOST * TURN
    return MOST * 360.0 if name in DEGREES else np.inf
