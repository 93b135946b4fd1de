"""Frames of all links of a robot for many postures at once, in NumPy."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.robot.robot import Robot


def link_frames(robot: Robot, q: Floats) -> Floats:
    """Where the links are.

    Args:
        robot: the chain.
        q: (K, n) rad.

    Returns:
        (K, n + 1, 4, 4) in the base frame: link 0 is the base itself, link i the frame of joint i after its rotation.
    """
    rest, cosine, sine = _terms(robot)
    steps = rest + np.cos(q)[..., None, None] * cosine + np.sin(q)[..., None, None] * sine
    frames: Floats = np.empty((len(q), robot.dof + 1, 4, 4))
    frames[:, 0] = np.eye(4)
    for i in range(robot.dof):
        np.matmul(frames[:, i], steps[:, i], out=frames[:, i + 1])
    return frames


@lru_cache(maxsize=256)
def _terms(robot: Robot) -> tuple[Floats, Floats, Floats]:
    """(n, 4, 4) each: placement times rotation is ``rest + cos q · cosine + sin q · sine`` (Rodrigues)."""
    axes = robot.joint_axes
    outer = np.einsum("ia,ib->iab", axes, axes)
    cross = np.cross(axes[:, None, :], np.eye(3)).swapaxes(1, 2)  # columns h × e
    nothing = np.zeros((robot.dof, 3))
    rest = transform(outer, nothing)
    cosine = transform(np.eye(3) - outer, nothing)
    sine = transform(cross, nothing)
    cosine[:, 3, 3] = sine[:, 3, 3] = 0.0
    place = robot.joint_placements
    return place @ rest, place @ cosine, place @ sine
