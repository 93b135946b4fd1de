"""Poses of a request as 4x4 transforms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import radians

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
from duocell.service.schemas.pose import (
    AbcDegrees,
    AxisAngle,
    EulerZyz,
    Matrix,
    Oat,
    Orientation,
    Pose,
    Quaternion,
    QuaternionWxyz,
    RollPitchYaw,
    WprDegrees,
)

MOST = 2.0
"""Turns."""
FORMATS: dict[type, tuple[str, Callable[[ArrayLike], Floats]]] = {
    Quaternion: ("quaternion", rotation_from_quaternion),
    Matrix: ("matrix", rotation_from_matrix),
    RollPitchYaw: ("rpy", rotation_from_rpy),
    EulerZyz: ("euler_zyz", rotation_from_euler_zyz),
    Oat: ("oat", rotation_from_oat),
    QuaternionWxyz: ("quaternion_wxyz", rotation_from_quaternion_wxyz),
    AxisAngle: ("axis_angle", rotation_from_axis_angle),
    AbcDegrees: ("abc_deg", rotation_from_abc_deg),
    WprDegrees: ("wpr_deg", rotation_from_wpr_deg),
}
"""Name and conversion of each format, for one rotation or a stack of them."""
ANGLES = RollPitchYaw, EulerZyz, Oat, AxisAngle
"""In radians."""
DEGREES = AbcDegrees, WprDegrees


def pose_of(pose: Pose, pointer: str, issues: IssueCollector) -> Floats:
    """(4, 4) transform; the identity where an issue had to be noted."""
    result: Floats = np.eye(4)
    name, converted = FORMATS[type(pose.orientation)]
    place, values = f"{pointer}/orientation/{name}", getattr(pose.orientation, name)
    if isinstance(pose.orientation, ANGLES):
        check_radians(values, place, issues)
    if isinstance(pose.orientation, DEGREES):
        _check_degrees(values, place, issues)
    with issues.at(place):
        result = transform(converted(values), pose.position)
    return result


def poses_of(poses: Sequence[Pose], pointer: str, issues: IssueCollector) -> Floats | None:
    """(m, 4, 4) transforms of a list of poses; None where issues had to be noted."""
    rotations = _rotations([pose.orientation for pose in poses])
    if rotations is not None:
        return transform(rotations, [pose.position for pose in poses])
    before = len(issues.found)
    one_by_one = [pose_of(pose, f"{pointer}/{index}", issues) for index, pose in enumerate(poses)]
    return np.array(one_by_one) if len(issues.found) == before else None


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


def _rotations(orientations: Sequence[Orientation]) -> Floats | None:
    """(m, 3, 3), all of a format converted at once: one by one takes forty times as long. None if any is wrong."""
    made = np.empty((len(orientations), 3, 3))
    for kind, (name, converted) in FORMATS.items():
        rows = [row for row, orientation in enumerate(orientations) if type(orientation) is kind]
        if not rows:
            continue
        values = np.array([getattr(orientations[row], name) for row in rows])
        if np.abs(values).max() > _largest(kind):
            return None
        try:
            made[rows] = converted(values)
        except InvalidRotation:
            return None
    return made


def _largest(kind: type) -> float:
    """Of the numbers of an orientation."""
    if kind in ANGLES:
        return MOST * TURN
    return MOST * 360.0 if kind in DEGREES else np.inf
