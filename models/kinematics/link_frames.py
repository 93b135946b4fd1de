"""Frames of all links of a robot for many postures at once, in NumPy."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.robot.robot import Robot


def link_frames(robot: Robot, q: Floats) -> Floats:
    """Where the links are.

    Args:
        robot: the chain.
        q: (K, n) rad or m.

    Returns:
        (K, n + 1, 4, 4) in the base frame: link 0 is the base itself, link i the frame of joint i after its motion.
    """
    rest, cosine, sine, linear = _terms(robot)
    steps = rest + np.cos(q)[..., None, None] * cosine + np.sin(q)[..., None, None] * sine
    if robot.slides:
        steps += q[..., None, None] * linear
    frames: Floats = np.empty((len(q), robot.dof + 1, 4, 4))
    frames[:, 0] = np.eye(4)
    for i in range(robot.dof):
        np.matmul(frames[:, i], steps[:, i], out=frames[:, i + 1])
    return frames


@lru_cache(maxsize=256)
def _terms(robot: Robot) -> tuple[Floats, Floats, Floats, Floats]:
    """(n, 4, 4) each: placement times motion of the joint, term by term (`duocell.models.robot.joint`)."""
    place, motions = robot.joint_placements, robot.motions
    return place @ motions.rest, place @ motions.cosine, place @ motions.sine, place @ motions.linear
