"""Kinematics of six-jointed arms on their own: what an answer is judged by shares nothing with what found it.

The inverse is written with the three subproblems of Paden and Kahan (a turn that takes one vector to another, that
brings a point to a distance, that brings a vector to a height), as Elias and Wen use them, for arms whose last three
axes meet and whose axes 2 and 3 are parallel, and for arms whose axes 2, 3 and 4 are parallel and whose last two
meet. All is vectorised over base places and poses, in the axes of the base at yaw 0.

Source: A. J. Elias, J. T. Wen, "IK-Geo: unified robot inverse kinematics using subproblem decomposition", 2022.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.robot.robot import Robot

MET = 1e-7
"""m; axes nearer than this meet; parallel ones differ in direction by less."""


@dataclass(frozen=True, eq=False)
class OwnArm:
    """Joint axes at the zero posture in the base frame.

    Attributes:
        axes: (6, 3) unit. points: (6, 3) m, one on each axis, chosen where axes meet.
        hand: (4, 4) flange at zero. kind: "spherical" (last three axes meet) or "parallel" (axes 2, 3, 4).
    """

    axes: Floats
    points: Floats
    hand: Floats
    kind: str


def own_arm(robot: Robot) -> OwnArm | None:
    """The arm as this file sees it, or None if it is of neither kind."""
    return _own(robot.kinematic_key, robot.dof, robot)


@lru_cache(maxsize=256)
def _own(key: tuple[bytes, bytes, bytes], dof: int, robot: Robot) -> OwnArm | None:
    if dof != 6:
        return None
    frame, axes, points = np.eye(4), [], []
    for placement, axis in zip(robot.joint_placements, robot.joint_axes, strict=True):
        frame = frame @ placement
        axes.append(frame[:3, :3] @ axis)
        points.append(frame[:3, 3].copy())
    hand, h, p = frame @ robot.flange_placement, np.array(axes), np.array(points)
    wrist = _meeting(h[4], p[4], h[5], p[5])
    if wrist is None or not _parallel(h[1], h[2]):
        return None
    p[4] = p[5] = wrist
    if _parallel(h[2], h[3]):
        return OwnArm(h, p, hand, "parallel")
    if float(np.linalg.norm(np.cross(h[3], wrist - p[3]))) < MET:
        p[3] = wrist
        return OwnArm(h, p, hand, "spherical")
    return None


def forward(arm: OwnArm, joints: Floats) -> Floats:
    """(..., 4, 4) flange in the base frame from joints (..., 6), by turns about the axes at zero, last one first."""
    rotation = np.broadcast_to(arm.hand[:3, :3], (*joints.shape[:-1], 3, 3))
    position = np.broadcast_to(arm.hand[:3, 3], (*joints.shape[:-1], 3))
    for i in range(5, -1, -1):
        turn = _rotation(arm.axes[i], joints[..., i])
        rotation = turn @ rotation
        position = np.einsum("...ij,...j->...i", turn, position - arm.points[i]) + arm.points[i]
    poses = np.zeros((*joints.shape[:-1], 4, 4))
    poses[..., :3, :3], poses[..., :3, 3], poses[..., 3, 3] = rotation, position, 1.0
    return poses


def inverse(arm: OwnArm, rotations: Floats, positions: Floats) -> tuple[Floats, Bools]:
    """All eight branches.

    Args:
        arm: the arm. rotations: (..., 3, 3) flange orientation. positions: (..., 3) m, both in the base frame.

    Returns:
        joints (8, ..., 6) rad modulo 2π, and (8, ...) True where the branch exists.
    """
    turned = rotations @ arm.hand[:3, :3].T
    back = arm.hand[:3, :3].T @ (arm.points[5] - arm.hand[:3, 3])
    wrist = positions + np.einsum("...ij,j->...i", rotations, back) - arm.points[0]
    shape = np.broadcast_shapes(turned.shape[:-2], wrist.shape[:-1])
    turned, wrist = np.broadcast_to(turned, (*shape, 3, 3)), np.broadcast_to(wrist, (*shape, 3))
    solve = _spherical if arm.kind == "spherical" else _three_parallel
    joints, exist = zip(*solve(arm, turned, wrist), strict=True)
    return np.array(joints), np.array(exist)


_Branch = tuple[Floats, Bools]


def _spherical(arm: OwnArm, turned: Floats, wrist: Floats) -> list[_Branch]:
    """Joints 1 to 3 bring the wrist's centre to its place, the last three turn the hand."""
    h, p = arm.axes, arm.points
    links = p[1] - p[0], p[2] - p[1], p[5] - p[2]
    found = []
    for s1, s3, s5 in product((1.0, -1.0), repeat=3):
        q1, good = _to_height(h[1], -h[0], wrist, float(h[1] @ sum(links)), s1)
        seen = _turn(-h[0], q1, wrist) - links[0]
        q3, near = _to_distance(h[2], links[2], links[1], np.linalg.norm(seen, axis=-1), s3)
        q2 = _to_vector(h[1], links[1] + _turn(h[2], q3, np.broadcast_to(links[2], seen.shape)), seen)
        left = turned
        for i, q in ((0, q1), (1, q2), (2, q3)):
            left = _rotation(h[i], -q) @ left
        q5, bent = _to_height(h[3], h[4], np.broadcast_to(h[5], wrist.shape), left @ h[5] @ h[3], s5)
        q4 = _to_vector(h[3], _turn(h[4], q5, np.broadcast_to(h[5], wrist.shape)), left @ h[5])
        away = np.swapaxes(left, -1, -2) @ h[3]
        q6 = -_to_vector(h[5], _turn(h[4], -q5, np.broadcast_to(h[3], wrist.shape)), away)
        found.append((np.stack([q1, q2, q3, q4, q5, q6], axis=-1), good & near & bent))
    return found


def _three_parallel(arm: OwnArm, turned: Floats, wrist: Floats) -> list[_Branch]:
    """Joints 1, 5 and 6 turn the hand out of the plane in which joints 2 to 4 move."""
    h, p = arm.axes, arm.points
    first, upper, fore, hand = p[1] - p[0], p[2] - p[1], p[3] - p[2], p[5] - p[3]
    found = []
    for s1, s5, s3 in product((1.0, -1.0), repeat=3):
        q1, good = _to_height(h[1], -h[0], wrist, float(h[1] @ (first + upper + fore + hand)), s1)
        level = _rotation(-h[0], q1) @ turned
        q5, bent = _to_height(h[1], h[4], np.broadcast_to(h[5], wrist.shape), level @ h[5] @ h[1], s5)
        q234 = _to_vector(h[1], _turn(h[4], q5, np.broadcast_to(h[5], wrist.shape)), level @ h[5])
        away = np.swapaxes(level, -1, -2) @ h[1]
        q6 = -_to_vector(h[5], _turn(h[4], -q5, np.broadcast_to(h[1], wrist.shape)), away)
        seen = _turn(-h[0], q1, wrist) - first - _turn(h[1], q234, np.broadcast_to(hand, wrist.shape))
        flat = seen - np.einsum("...i,i->...", seen, h[1])[..., None] * h[1]
        arms = upper - (upper @ h[1]) * h[1], fore - (fore @ h[1]) * h[1]
        q3, near = _to_distance(h[2], arms[1], arms[0], np.linalg.norm(flat, axis=-1), s3)
        q2 = _to_vector(h[1], arms[0] + _turn(h[2], q3, np.broadcast_to(arms[1], flat.shape)), flat)
        sense = float(np.sign(h[1] @ h[2])), float(np.sign(h[1] @ h[3]))
        q4 = sense[1] * (q234 - q2 - sense[0] * q3)
        found.append((np.stack([q1, q2, q3, q4, q5, q6], axis=-1), good & near & bent))
    return found


# --- subproblems ------------------------------------------------------------------------------------------------------


def _rotation(axis: Floats, angle: Floats) -> Floats:
    """(..., 3, 3) by Rodrigues' formula."""
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    sine, versine = np.sin(angle)[..., None, None], (1.0 - np.cos(angle))[..., None, None]
    made: Floats = np.eye(3) + sine * cross + versine * (cross @ cross)
    return made


def _turn(axis: Floats, angle: Floats, vector: Floats) -> Floats:
    turned: Floats = np.einsum("...ij,...j->...i", _rotation(axis, angle), vector)
    return turned


def _to_vector(axis: Floats, start: Floats, end: Floats) -> Floats:
    """Angle about an axis that turns ``start`` (..., 3) towards ``end``."""
    aside = np.cross(axis, start)
    across = start - np.einsum("...i,i->...", start, axis)[..., None] * axis
    angle: Floats = np.arctan2(np.sum(aside * end, axis=-1), np.sum(across * end, axis=-1))
    return angle


def _to_height(along: Floats, axis: Floats, vector: Floats, height: Floats | float, sign: float) -> _Branch:
    """Angle with ``along · Rot(axis, angle) vector == height``, one of the two by ``sign``, and where there is one."""
    lever = np.einsum("...i,i->...", np.cross(axis, vector), along)
    across = vector - np.einsum("...i,i->...", vector, axis)[..., None] * axis
    flat = np.einsum("...i,i->...", across, along)
    rest = height - np.einsum("...i,i->...", vector, axis) * float(axis @ along)
    size = np.hypot(lever, flat)
    ratio = rest / np.maximum(size, 1e-15)
    return np.arctan2(lever, flat) + sign * np.arccos(np.clip(ratio, -1.0, 1.0)), np.abs(ratio) <= 1.0


def _to_distance(axis: Floats, moved: Floats, still: Floats, distance: Floats, sign: float) -> _Branch:
    """Angle with ``|still + Rot(axis, angle) moved| == distance``, one of the two by ``sign``."""
    rest = 0.5 * (distance**2 - still @ still - moved @ moved)
    return _to_height(still, axis, np.broadcast_to(moved, (*distance.shape, 3)), rest, sign)


def _parallel(one: Floats, other: Floats) -> bool:
    return float(np.linalg.norm(np.cross(one, other))) < MET


def _meeting(one: Floats, on_one: Floats, other: Floats, on_other: Floats) -> Floats | None:
    """Where two lines meet, or None."""
    normal = np.cross(one, other)
    if float(np.linalg.norm(normal)) < MET or abs(float(normal @ (on_other - on_one))) > MET:
        return None
    share = np.linalg.lstsq(np.column_stack([one, -other]), on_other - on_one, rcond=None)[0]
    meeting: Floats = on_one + share[0] * one
    return meeting
