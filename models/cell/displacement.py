"""Displacements as functions of their parameters: in numbers, their derivatives, and in symbols for the program.

The tilt is written as a unit quaternion whose vector part, sin(θ/2) times the axis, is sin(α/2) times a point of the
unit disc; α is half the opening angle of the cone. The parameters (u, v), rad in [-α, α] each, are taken to the disc by

    x = a √(1 - b²/2),   y = b √(1 - a²/2),   a = u/α,   b = v/α,

whose square 1 - (1 - a²)(1 - b²) reaches 1 on the edges of the square and nowhere inside: the cone is covered exactly,
smoothly, and by bounds alone (a map of the square to the disc along ellipses, known from texture mapping).
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, rotation_y, rotation_z, transform
from duocell.models.robot.freedom import SIZE, TILT


def displaced(full: Floats, cone: Floats) -> Floats:
    """(..., 4, 4) displacements for parameters (..., 8) and cones (...) [rad]."""
    rotation = rotation_z(full[..., 7])
    if np.any(full[..., 6]):
        rotation = rotation_y(full[..., 6]) @ rotation
    if np.any(full[..., 5]):
        rotation = rotation_x(full[..., 5]) @ rotation
    if np.any(full[..., TILT]):
        rotation = _tilt(full[..., TILT], cone) @ rotation
    return transform(rotation, full[..., :3])


def displacement_twists(full: Floats, cone: Floats, points: Floats) -> tuple[Floats, Floats]:
    """(m, 3, 8) m and rad per unit of parameters (m, 8): velocity of points (m, 3) that are displaced, and turn.

    Args:
        full: (m, 8). cone: (m,) rad.
        points: (m, 3) m, before the displacement.
    """
    m = len(full)
    linear, angular = np.zeros((m, 3, SIZE)), np.zeros((m, 3, SIZE))
    linear[:, :, :3] = np.eye(3)
    angular[:, :, TILT] = _tilt_rates(full[:, TILT], cone)
    turned = _tilt(full[:, TILT], cone)
    angular[:, :, 5] = turned[:, :, 0]
    turned = turned @ rotation_x(full[:, 5])
    angular[:, :, 6] = turned[:, :, 1]
    turned = turned @ rotation_y(full[:, 6])
    angular[:, :, 7] = turned[:, :, 2]
    arms = (turned @ rotation_z(full[:, 7]) @ points[..., None])[..., 0]
    linear[:, :, 3:] = np.cross(angular[:, :, 3:], arms[:, :, None], axis=1)
    return linear, angular


def _disc(tilt: Floats, cone: Floats) -> tuple[Floats, Floats, Floats]:
    """a, b in [-1, 1] and sin(α/2); 0 without a cone."""
    share = np.where(cone > 0.0, 1.0 / np.where(cone > 0.0, cone, 1.0), 0.0)
    return tilt[..., 0] * share, tilt[..., 1] * share, np.sin(0.5 * cone)


def _tilt(tilt: Floats, cone: Floats) -> Floats:
    """(..., 3, 3) the shortest turns of the z axis into the cone for (u, v) (..., 2)."""
    a, b, size = _disc(tilt, cone)
    x, y = size * a * np.sqrt(1.0 - 0.5 * b * b), size * b * np.sqrt(1.0 - 0.5 * a * a)
    w = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    rows = (
        (1.0 - 2.0 * y * y, 2.0 * x * y, 2.0 * w * y),
        (2.0 * x * y, 1.0 - 2.0 * x * x, -2.0 * w * x),
        (-2.0 * w * y, 2.0 * w * x, 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _tilt_rates(tilt: Floats, cone: Floats) -> Floats:
    """(m, 3, 2) rad of turn per rad of u and v: 2 (dq q*) of the quaternion q."""
    a, b, size = _disc(tilt, cone)
    root_a, root_b = np.sqrt(1.0 - 0.5 * a * a), np.sqrt(1.0 - 0.5 * b * b)
    x, y = size * a * root_b, size * b * root_a
    w = np.sqrt(np.maximum(1.0 - x * x - y * y, 1e-300))
    rate = np.where(cone > 0.0, size / np.where(cone > 0.0, cone, 1.0), 0.0)
    rates = []
    for dx, dy in ((root_b, -0.5 * a * b / root_a), (-0.5 * a * b / root_b, root_a)):
        dw = -(x * dx + y * dy) / w
        rates.append(2.0 * rate[:, None] * np.stack([w * dx - dw * x, w * dy - dw * y, x * dy - y * dx], axis=-1))
    turn: Floats = np.stack(rates, axis=-1)
    return turn


# --- in symbols -------------------------------------------------------------------------------------------------------


def displaced_symbols(which: Sequence[int], values: ca.SX, cone: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Rotation (3, 3) and position (3,) of a displacement whose open parameters are symbols, the others 0.

    Args:
        which: (k,) of the parameters. values: (k,) theirs. cone: rad, one symbol.
    """
    full = dict(zip(which, (values[i] for i in range(len(which))), strict=True))
    position = ca.vertcat(*(full.get(i, ca.SX(0)) for i in range(3)))
    rotation = ca.SX.eye(3)
    if TILT.start in full or TILT.start + 1 in full:
        rotation = _tilt_symbols(full.get(3, ca.SX(0)), full.get(4, ca.SX(0)), cone)
    for index, axis in ((5, 0), (6, 1), (7, 2)):
        if index in full:
            rotation = rotation @ _turn_symbols(axis, full[index])
    return rotation, position


def _tilt_symbols(u: ca.SX, v: ca.SX, cone: ca.SX) -> ca.SX:
    """As `_tilt`; without a cone (0) no turn."""
    share = ca.if_else(cone > 0.0, 1.0 / ca.fmax(cone, 1e-9), 0.0)
    a, b, size = u * share, v * share, ca.sin(0.5 * cone)
    x, y = size * a * ca.sqrt(1.0 - 0.5 * b * b), size * b * ca.sqrt(1.0 - 0.5 * a * a)
    w = ca.sqrt(1.0 - x * x - y * y)
    return ca.blockcat(
        [
            [1.0 - 2.0 * y * y, 2.0 * x * y, 2.0 * w * y],
            [2.0 * x * y, 1.0 - 2.0 * x * x, -2.0 * w * x],
            [-2.0 * w * y, 2.0 * w * x, 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _turn_symbols(axis: int, angle: ca.SX) -> ca.SX:
    """A turn about a coordinate axis."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn = ca.SX.eye(3)
    turn[i, i], turn[j, j] = ca.cos(angle), ca.cos(angle)
    turn[i, j], turn[j, i] = -ca.sin(angle), ca.sin(angle)
    return turn
