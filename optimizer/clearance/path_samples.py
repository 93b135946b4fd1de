"""Configurations between the poses of a path: the object moves straight from pose to pose, the arms follow it.

Positions are interpolated linearly, orientations along the shortest rotation, at constant speed. Joints follow by
Newton's method from the middle of their neighbours, so they stay on the branch of the poses.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.pose import inverse, rotation_vector, transform
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.batch_kinematics import forward_and_jacobian, pose_error
from duocell.models.kinematics.chain import chain_of
from duocell.models.robot.arm import Arm
from duocell.models.robot.robot import Robot

ITERATIONS = 12
REACHED = 1e-8
"""m and rad."""
STRAY = 0.15
"""rad; how far joints may stray from the middle of their neighbours, beyond half the neighbours' distance."""


class ObjectPath:
    """The object's way through the poses of a task.

    Attributes:
        poses: (m, 4, 4) in the world.
        shifts: (m - 1, 3) m from each pose to the next.
        turns: (m - 1, 3) rad, rotation vectors likewise, in the frame of the earlier pose.
    """

    def __init__(self, poses: Floats) -> None:
        """Keep the steps between the poses (m, 4, 4)."""
        self.poses = poses
        self.shifts = np.diff(poses[:, :3, 3], axis=0)
        self.turns = rotation_vector(poses[:-1, :3, :3].swapaxes(1, 2) @ poses[1:, :3, :3])

    def at(self, steps: Ints, fractions: Floats) -> Floats:
        """(K, 4, 4) object frames after a fraction (K,) of the way from pose ``steps`` (K,) to the next."""
        start = self.poses[steps]
        rotations = start[:, :3, :3] @ _exponentials(fractions[:, None] * self.turns[steps])
        return transform(rotations, start[:, :3, 3] + fractions[:, None] * self.shifts[steps])


def _exponentials(vectors: Floats) -> Floats:
    """(K, 3, 3) rotations of rotation vectors (K, 3)."""
    angles = np.linalg.norm(vectors, axis=1)
    x, y, z = (vectors / np.where(angles > 0.0, angles, 1.0)[:, None]).T
    zero = np.zeros_like(x)
    cross = np.stack([np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))], axis=-2)
    sine, versine = np.sin(angles)[:, None, None], 2.0 * np.sin(0.5 * angles)[:, None, None] ** 2
    rotations: Floats = np.eye(3) + sine * cross + versine * (cross @ cross)
    return rotations


def flanges_at(
    cell: Cell, arm: Arm, objects: Floats, steps: Ints, fractions: Floats, free: Floats | None = None
) -> Floats:
    """(K, 4, 4) flange poses of an arm in the world between two poses.

    Where the hand is displaced on the part from pose to pose, it moves there straight and turns the shortest way.

    Args:
        cell: task. arm: the arm. objects: (K, 4, 4) object frames in the world, there.
        steps: (K,) the pose before. fractions: (K,) of the way to the next.
        free: (m, k) parameters that the poses leave open, see `Cell.flange_targets`.
    """
    exact = arm.freedom is None
    grasps = cell.held(arm)[steps] if exact else ObjectPath(cell.grasps(arm, free)).at(steps, fractions)
    flanges: Floats = objects @ grasps @ inverse(arm.tool)
    return flanges


def keep_inside(arm: Arm, base: Floats, flanges: Floats, joints: Floats) -> tuple[Floats, Bools]:
    """Joints of a redundant arm at the same poses, moved inside their limits by its self-motion.

    A joint that was beyond a limit is held at it, and so is a sum of joints beyond its linear limit: one more equation.

    Args:
        arm: whose limits. base: (4, 4) in the world.
        flanges: (K, 4, 4) in the world.
        joints: (K, n) rad to begin with.

    Returns:
        (K, n) rad, joints that were beyond a limit at it; and (K,) False where Newton's method does not arrive.
    """
    chain, targets = chain_of(arm.robot), inverse(base) @ flanges
    rows, lower, upper = arm.bounded_slopes[arm.dof :], arm.bounded_lower[arm.dof :], arm.bounded_upper[arm.dof :]
    held: Bools = np.zeros(joints.shape, dtype=np.bool_)
    linked: Bools = np.zeros((len(joints), len(rows)), dtype=np.bool_)
    for _ in range(ITERATIONS):
        held |= (joints < arm.lower) | (joints > arm.upper)
        joints = np.clip(joints, arm.lower, arm.upper)
        rotations, positions, jacobians = forward_and_jacobian(chain, joints)
        sums = joints @ rows.T
        inside = np.clip(sums, lower, upper)
        linked |= np.abs(sums - inside) > REACHED
        error = np.concatenate([pose_error(rotations, positions, targets), inside - sums], axis=1)
        good: Bools = np.max(np.abs(error), axis=1) < REACHED
        if np.all(good):
            break
        slopes = np.concatenate([jacobians, np.where(linked[..., None], rows, 0.0)], axis=1)
        free = np.where(held[:, None, :], 0.0, slopes)
        across = free.swapaxes(1, 2)
        damped = free @ across + 1e-12 * np.eye(free.shape[1])
        step = (across @ np.linalg.solve(damped, error[..., None]))[..., 0]
        joints = joints + np.where(good[:, None], 0.0, step)
    return np.clip(joints, arm.lower, arm.upper), good


def follow(robot: Robot, base: Floats, flanges: Floats, before: Floats, after: Floats) -> tuple[Floats, Bools]:
    """Joints between two postures that take the flange to poses in between.

    Args:
        robot: the arm. base: (4, 4) in the world.
        flanges: (K, 4, 4) in the world.
        before: (K, n) rad, the posture on one side. after: likewise on the other.

    Returns:
        (K, n) rad; and (K,) False where Newton's method does not arrive or leaves the branch: no continuous way here.
        A redundant arm's self-motion keeps to the middle.
    """
    chain = chain_of(robot)
    targets = inverse(base) @ flanges
    middle = 0.5 * (before + after)
    q = middle.copy()
    good: Bools = np.zeros(len(q), dtype=np.bool_)
    for _ in range(ITERATIONS):
        rotations, positions, jacobians = forward_and_jacobian(chain, q)
        error = pose_error(rotations, positions, targets)
        size = np.max(np.abs(error), axis=1)
        good = size < REACHED
        if np.all(good):
            break
        transposed = jacobians.swapaxes(1, 2)
        damping = np.minimum(1e-3, size**2)[:, None, None] + 1e-15
        step = (transposed @ np.linalg.solve(jacobians @ transposed + damping * np.eye(6), error[..., None]))[..., 0]
        longest = np.max(np.abs(step), axis=1, keepdims=True)
        q = q + step * np.minimum(1.0, 0.3 / np.maximum(longest, 1e-300))
    apart = np.max(np.abs(after - before), axis=1)
    return q, good & (np.max(np.abs(q - middle), axis=1) <= 0.5 * apart + STRAY)
