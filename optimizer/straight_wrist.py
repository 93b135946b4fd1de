"""Base positions from which some pose is taken with the wrist straight: axes 4 and 6 of a spherical wrist in line.

There joints 4 and 6 of that pose can share their turn as they like, and close by its direction decides how they do. So
around such a place the cost takes a whole range of values, and the best optimum may be a notch too narrow for any spread
of points. But the places are few and have a closed form: the forearm's direction is known, so pitch and bearing of the
arm's plane are; the height of the base gives the upper arm, and with it the distance of the base.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arm import TURN
from models.arrays import Bools, Floats, Ints
from optimizer.reduced import Paths, ReducedProblem, evaluate_signed

LEVELS = 16
"""Heights looked at where the height of the base is free."""
RIGHT = 1e-9
"""Largest cosine between axes that counts as a right angle."""
AROUND, RADIUS = 12, 5e-4
"""Points on a small circle about a place, and its radius (m): they share the turn in as many ways."""
MOST = 64
"""Places looked around at."""


@dataclass(frozen=True, eq=False, slots=True)
class StraightPlaces:
    """Places and what they are.

    Attributes:
        positions: (K, 3) m. pose: (K,) index of the pose that is taken with a straight wrist.
        shoulder: (K,) sign. elbow: (K,) sign.
    """

    positions: Floats
    pose: Ints
    shoulder: Ints
    elbow: Ints


def straight_places(problem: ReducedProblem, box: Floats) -> StraightPlaces:
    """All of them inside a box, at a few heights where that is free; none for wrists and mounts of other kinds.

    Args:
        problem: an arm with a first axis along the vertical.
        box: (3, 2) m.
    """
    form, arm = problem.form, problem.arm
    h1, h4 = form.axes[0], form.axes[3]
    upward = arm.mount @ h1
    oblique = max(abs(form.tilt_cos), abs(form.tilt_sin - 1.0)) > RIGHT
    if form.kind != "spherical-wrist" or oblique or abs(upward[2]) < 1.0 - RIGHT:
        none = np.zeros(0, dtype=np.int64)
        return StraightPlaces(np.empty((0, 3)), none, none, none)
    level = np.linspace(*box[2], LEVELS if box[2, 1] > box[2, 0] else 1)
    # W of every pose from a base at the world's origin, in axes of the mount; the base position will be subtracted.
    wrist = problem.positions @ arm.mount + problem.rotations @ form.wrist_in_flange - form.origin
    along = (wrist @ h1)[:, None] - upward[2] * level  # (m, L)
    tool_axis = problem.rotations @ (form.home_rotation.T @ form.axes[5])
    found = []
    for sense in (1.0, -1.0):
        for side in (1.0, -1.0):
            exists, fore, first = _forearm(form.n, h1, h4, sense * tool_axis, side)
            for tilt in (1.0, -1.0):
                found.append(_places(problem, along, fore, first, tilt, exists))
    radial, shoulder, elbow = (np.stack([part[k] for part in found], axis=1) for k in range(3))  # (m, 8, L, ...)
    positions = (wrist[:, None, None, :] - radial) @ arm.mount.T
    positions[..., 2] = level
    inside = np.all((positions >= box[:, 0]) & (positions <= box[:, 1]), axis=-1) & (shoulder * elbow != 0.0)
    pose = np.broadcast_to(np.arange(len(wrist))[:, None, None], inside.shape)
    signs = (shoulder[inside].astype(np.int64), elbow[inside].astype(np.int64))
    return StraightPlaces(positions[inside], pose[inside], *signs)
