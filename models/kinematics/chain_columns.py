"""Forward kinematics and Jacobians of many postures at once, the postures on the last axis.

The same numbers as `duocell.models.kinematics.batch_kinematics`, laid out as a structure of arrays: every component of
a frame is one contiguous row over all postures, so that each joint costs a few multiplications of long rows. Three
times as fast for a thousand postures, and what follows (6x6 factorisations written out over the rows) wants this layout
anyway.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.chain import Chain, chain_of
from duocell.models.robot.joint import move_columns
from duocell.models.robot.robot import Robot

NOTHING = 1e-12
"""m; offsets below are left out."""


class ColumnChain:
    """A chain with a frame on every joint axis, the axis as its z.

    Frame i turns by q_i about its z, or shifts along it; ``turns[i]`` (3, 3) and ``offsets[i]`` (3,) [m] lead from
    there to the next frame (after the last joint: to the flange).
    """

    def __init__(self, chain: Chain) -> None:
        frames = [_frame(axis) for axis in chain.axes] + [chain.home[:3, :3]]
        points = [*chain.points, chain.home[:3, 3]]
        self.dof = len(chain.axes)
        self.prismatic = [bool(shifts) for shifts in chain.motions.prismatic]
        self.first, self.origin = frames[0], points[0]
        self.turns = [np.ascontiguousarray((a.T @ b).T) for a, b in pairwise(frames)]
        self.offsets = [a.T @ (q - p) for a, p, q in zip(frames, points, points[1:], strict=False)]

    def forward(self, q: Floats) -> tuple[Floats, Floats]:
        """Flange of postures (n, N) [rad or m]: columns of its rotation (3 columns, 3, N), position (3, N) [m]."""
        columns, position = self._start(q.shape[1])
        for i in range(self.dof):
            columns, position = self._pass(i, q[i], columns, position)
        return columns, position

    def forward_and_jacobian(self, q: Floats) -> tuple[Floats, Floats, Floats]:
        """As `forward`, and the Jacobian (n, 6, N) of the flange origin in base axes, linear rows first."""
        count = q.shape[1]
        columns, position = self._start(count)
        jacobian = np.empty((self.dof, 6, count))
        points = np.empty((self.dof, 3, count))
        for i in range(self.dof):
            jacobian[i, 3:] = columns[2]
            points[i] = position
            columns, position = self._pass(i, q[i], columns, position)
        axis, lever = jacobian[:, 3:], position - points
        jacobian[:, 0] = axis[:, 1] * lever[:, 2] - axis[:, 2] * lever[:, 1]
        jacobian[:, 1] = axis[:, 2] * lever[:, 0] - axis[:, 0] * lever[:, 2]
        jacobian[:, 2] = axis[:, 0] * lever[:, 1] - axis[:, 1] * lever[:, 0]
        for i in range(self.dof):
            if self.prismatic[i]:
                jacobian[i, :3], jacobian[i, 3:] = jacobian[i, 3:], 0.0
        return columns, position, jacobian

    def _start(self, count: int) -> tuple[Floats, Floats]:
        columns, position = np.empty((3, 3, count)), np.empty((3, count))
        columns[:] = self.first.T[:, :, None]
        position[:] = self.origin[:, None]
        return columns, position

    def _pass(self, i: int, values: Floats, columns: Floats, position: Floats) -> tuple[Floats, Floats]:
        """From the frame of joint ``i`` at zero to the next frame."""
        position = move_columns(self.prismatic[i], values, columns, position)
        for k in range(3):
            if abs(self.offsets[i][k]) > NOTHING:
                position = position + self.offsets[i][k] * columns[k]
        return (self.turns[i] @ columns.reshape(3, -1)).reshape(columns.shape), position


@lru_cache(maxsize=64)
def column_chain(robot: Robot) -> ColumnChain:
    """The chain of ``robot`` for many postures at once (cached)."""
    return ColumnChain(chain_of(robot))


def rotation_vectors(columns: Floats, target: Floats) -> Floats:
    """(3, N) rotation vectors [rad] from rotations to others, both as columns (3 columns, 3, N) in common axes."""
    skew = 0.5 * np.stack(
        [
            np.sum(columns[:, 1] * target[:, 2] - columns[:, 2] * target[:, 1], axis=0),
            np.sum(columns[:, 2] * target[:, 0] - columns[:, 0] * target[:, 2], axis=0),
            np.sum(columns[:, 0] * target[:, 1] - columns[:, 1] * target[:, 0], axis=0),
        ]
    )
    sine = np.sqrt(np.sum(skew * skew, axis=0))
    angle = np.arctan2(sine, 0.5 * (np.sum(columns * target, axis=(0, 1)) - 1.0))
    vectors: Floats = skew * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)
    return vectors


def _frame(axis: Floats) -> Floats:
    """(3, 3) some rotation whose z is ``axis``."""
    side = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(axis, side), axis], axis=1)
