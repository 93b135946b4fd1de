"""Forward kinematics and Jacobians of many postures at once, from the screw axes, in NumPy."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.chain import Chain
from duocell.models.kinematics.kinematics import without_units
from duocell.models.robot.joint import moved_by


def forward_and_jacobian(chain: Chain, q: Floats) -> tuple[Floats, Floats, Floats]:
    """Flange pose and geometric Jacobian.

    Args:
        chain: screw axes.
        q: (K, n) rad or m.

    Returns:
        rotations (K, 3, 3), positions (K, 3) m, Jacobians (K, 6, n) of the flange origin in base axes, linear rows
        first.
    """
    count, n = q.shape
    motions = chain.motions
    rotation = np.broadcast_to(np.eye(3), (count, 3, 3))
    origin = np.zeros((count, 3))  # where the zero position's base origin has gone
    axes, points = np.empty((n, count, 3)), np.empty((n, count, 3))
    for i in range(n):
        h, p = chain.axes[i], chain.points[i]
        axes[i], points[i] = rotation @ h, origin + rotation @ p
        if motions.prismatic[i]:
            origin = origin + q[:, i, None] * axes[i]
            continue
        turn = motions.rotation(i, q[:, i])
        origin = origin + rotation @ p - (rotation @ turn) @ p
        rotation = rotation @ turn
    positions = origin + rotation @ chain.home[:3, 3]
    linear = moved_by(motions.prismatic[:, None], axes, positions - points)
    angular = np.where(motions.prismatic[:, None, None], 0.0, axes) if np.any(motions.prismatic) else axes
    return rotation @ chain.home[:3, :3], positions, np.concatenate([linear, angular], axis=-1).transpose(1, 2, 0)


def pose_error(rotations: Floats, positions: Floats, target: Floats) -> Floats:
    """(K, 6) what is missing to ``target`` (4, 4) or (K, 4, 4): metres, then the rotation vector [rad] in base axes."""
    error = target[..., :3, :3] @ np.swapaxes(rotations, -1, -2)
    skew = 0.5 * np.stack(
        [
            error[..., 2, 1] - error[..., 1, 2],
            error[..., 0, 2] - error[..., 2, 0],
            error[..., 1, 0] - error[..., 0, 1],
        ],
        axis=-1,
    )
    sine = np.linalg.norm(skew, axis=-1)
    angle = np.arctan2(sine, 0.5 * (np.trace(error, axis1=-2, axis2=-1) - 1.0))
    scale = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)
    return np.concatenate([target[..., :3, 3] - positions, skew * scale[..., None]], axis=-1)


def conditioning_of(chain: Chain, tool: Floats, q: Floats, length: float) -> Floats:
    """Reciprocal condition numbers as `duocell.models.kinematics.kinematics.conditioning`, for many postures at once.

    Args:
        chain: screw axes.
        tool: (4, 4) TCP in the flange frame.
        q: (K, n) rad or m.
        length: m, see `duocell.models.kinematics.kinematics.without_units`.

    Returns:
        (K,) σmin/σmax.
    """
    rotations, _, jacobians = forward_and_jacobian(chain, q)
    offset = rotations @ tool[:3, 3]
    jacobians[:, :3] += np.cross(jacobians[:, 3:], offset[:, :, None], axis=1)
    sigma = np.linalg.svd(without_units(jacobians, chain.motions.prismatic, length), compute_uv=False)
    ratio: Floats = sigma[:, -1] / sigma[:, 0]
    return ratio
