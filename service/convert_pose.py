"""Poses of a request as 4x4 transforms."""

from __future__ import annotations

import numpy as np

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
from service.schemas.pose import EulerZyz, Matrix, Orientation, Pose, Quaternion, RollPitchYaw


def pose_of(pose: Pose, pointer: str, issues: Issues) -> Floats:
    """(4, 4) transform; the identity where an issue had to be noted."""
    result: Floats = np.eye(4)
    with issues.at(pointer + "/orientation/" + next(iter(type(pose.orientation).model_fields))):
        result = transform(_rotation(pose.orientation), pose.position)
    return result


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
