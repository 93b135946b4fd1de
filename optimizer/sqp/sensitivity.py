"""How the joints follow when a base moves and the hand stays where the task wants it."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.batch_kinematics import forward_and_jacobian
from duocell.models.kinematics.chain import chain_of
from duocell.models.robot.robot import Robot

DAMPING = 1e-8
"""On the squared singular values: near a singularity the joints' motion is large but finite."""


def joints_by_base(robot: Robot, rotation: Floats, joints: Floats) -> Floats:
    """Derivative of the joints by the base placement at fixed flange poses.

    Moving the base by dΓ moves every flange target rigidly as the arm sees it: ``J dq = V dΓ``.

    Args:
        robot: the arm.
        rotation: (3, 3) base axes in the world, or (K, 3, 3) of a base for each.
        joints: (K, n) rad.

    Returns:
        (K, n, 4) rad per m of x, y, z in the world, rad per rad of yaw about the base's z axis; for redundant arms the
        least motion.
    """
    _, positions, jacobians = forward_and_jacobian(chain_of(robot), joints)
    twist: Floats = np.zeros((len(joints), 6, 4))
    twist[:, :3, :3] = -rotation.swapaxes(-1, -2)
    twist[:, :3, 3] = -np.cross([0.0, 0.0, 1.0], positions)
    twist[:, 5, 3] = -1.0
    transposed = jacobians.swapaxes(1, 2)
    motion: Floats = transposed @ np.linalg.solve(jacobians @ transposed + DAMPING * np.eye(6), twist)
    return motion
