"""Poses of a request as 4x4 transforms."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

import numpy as np

from models.arm import TURN
from models.arrays import Floats
from models.pose import (
    rotation_from_euler_zyz,
    rotation_from_matrix,
    rotation_from_oat,
    rotation_from_quaternion,
    rotation_from_rpy,
    transform,
)
from service.issues import Issues
from service.schemas.pose import EulerZyz, Matrix, Oat, Orientation, Pose, Quaternion, RollPitchYaw

MOST = 2.0
"""Turns."""


def pose_of(pose: Pose, pointer: str, issues: Issues) -> Floats:
    """(4, 4) transform; the identity where an issue had to be noted."""
    result: Floats = np.eye(4)
    name = next(iter(type(pose.orientation).model_fields))
    place = f"{pointer}/orientation/{name}"
    if isinstance(pose.orientation, (RollPitchYaw, EulerZyz, Oat)):
        check_radians(getattr(pose.orientation, name), place, issues)
    with issues.at(place):
        result = transform(_rotation(pose.orientation), pose.position)
    return result


def check_radians(angles: Sequence[float], pointer: str, issues: Issues) -> None:
    """Note angles beyond `MOST` turns: nobody means them, they are degrees."""
    worst = max(angles, key=abs)
    if abs(worst) > MOST * TURN:
        issues.add(
            pointer,
            f"{worst:g} rad is more than {MOST:g} turns; angles are in radians. If degrees were meant: "
            f"{worst:g}° is {radians(worst):.6g} rad.",
        )


def _rotation(orientation: Orientation) -> Floats:
    """(3, 3), or InvalidRotation."""
    match orientation:
        case Quaternion():
            return rotation_from_quaternion(orientation.quaternion)
        case Matrix():
            return rotation_from_matrix(orientation.matrix)
        case RollPitchYaw():
            return rotation_from_rpy(orientation.rpy)
        case EulerZyz():
            return rotation_from_euler_zyz(orientation.euler_zyz)
        case _:
            return rotation_from_oat(orientation.oat)
