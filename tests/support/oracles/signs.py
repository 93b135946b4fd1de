"""Postures told from the joint axes themselves, multiplied out here; no constants of the closed forms."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.nominal import nominal
from duocell.models.robot.robot import Robot


def joint_axes(robot: Robot, joints: Floats) -> tuple[Floats, Floats]:
    """Directions and points (n, K, 3) of the joint axes in the base frame, for joints (K, n)."""
    rotation, origin = np.eye(3), np.zeros(3)
    axes, points = [], []
    for placement, axis, angles in zip(robot.joint_placements, robot.joint_axes, joints.T, strict=True):
        origin = origin + rotation @ placement[:3, 3]
        rotation = rotation @ placement[:3, :3] @ rotation_about(axis, angles)
        axes.append(rotation @ axis)
        points.append(np.broadcast_to(origin, (len(joints), 3)))
    return np.array(axes), np.array(points)


def axis_signs(robot: Robot, joints: Floats) -> Floats | None:
    """(K, 3) signs that tell postures apart, None for arms without a closed form.

    Each is the sign of a triple product of joint axes and the lines between them, so it changes exactly where the arm
    is singular: wrist above axis 1; shoulder, elbow and wrist in line; axes 4, 5, 6 (or 2, 5, 6) in one plane.
    Their meaning differs from arm to arm by a constant sign.
    """
    meant = nominal(robot) if closed_form(robot) is None else None
    robot = robot if meant is None else meant.robot  # postures are those of the arm that was drawn
    form = closed_form(robot)
    if form is None:
        return None
    axis, point = joint_axes(robot, joints)
    parallel = form.kind == "three-parallel"
    wrist = _nearest(point[4], axis[4], point[5], axis[5])
    front = _dot(axis[1], np.cross(axis[0], wrist - point[0]))
    upper, fore = point[2] - point[1], (point[3] if parallel else wrist) - point[2]
    upper, fore = (link - axis[1] * _dot(axis[1], link)[:, None] for link in (upper, fore))
    bend = _dot(axis[1], np.cross(upper, fore))
    twist = _dot(axis[4], np.cross(axis[1] if parallel else axis[3], axis[5]))
    signs: Floats = np.sign(np.stack([front, bend, twist], axis=1))
    return signs


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.sum(a * b, axis=-1)
    return product


def _nearest(p: Floats, u: Floats, q: Floats, v: Floats) -> Floats:
    """The points of lines (p, u) nearest to lines (q, v)."""
    n = np.cross(u, v)
    along = _dot(np.cross(q - p, v), n) / _dot(n, n)
    nearest: Floats = p + u * along[:, None]
    return nearest
