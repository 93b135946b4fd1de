"""Where an arm with a spherical wrist takes a pose with axes 4 and 6 in line: the wrist singularity, in closed form.

The direction of axis 4 is then that of axis 6, which the pose gives, or the opposite. The first three joints turn axis
4 by the pitch about n and by q1 about axis 1, and two directions that such turns connect leave two values of each. The
pitch gives the forearm, the height of the base the upper arm (two values), and so the distance of W from axis 1:
eight ways for every pose and height. Symbols as in `duocell.models.kinematics.closed_form`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.kinematics.closed_form import ClosedForm

RIGHT = 1e-9
"""Cosine up to which axes count as at right angles: only then can axes 4 and 6 come in line."""


def can_be_straight(form: ClosedForm) -> bool:
    """True for spherical wrists with axes at right angles."""
    return form.kind == "spherical-wrist" and abs(form.tilt_cos) <= RIGHT and form.tilt_sin >= 1.0 - RIGHT


@dataclass(frozen=True, eq=False, slots=True)
class StraightWrists:
    """Where W is, seen from the base at yaw 0, when poses are taken with a straight wrist, in eight ways.

    Attributes:
        wrist: (8, m, L, 3) m, from the origin on axis 1.
        shoulder: (8, m, L) sign, 0 where there is no such place. elbow: likewise.
        joints: (3, 8, m, L) rad modulo 2π, joints 2, 3 and 5 there.
    """

    wrist: Floats
    shoulder: Ints
    elbow: Ints
    joints: Floats


def straight_wrists(form: ClosedForm, tool_axis: Floats, along: Floats) -> StraightWrists:
    """All ways of taking poses with a straight wrist.

    Args:
        form: an arm that `can_be_straight`.
        tool_axis: (m, 3) unit, direction of axis 6 in the poses.
        along: (m, L) m, component of W along axis 1, measured from the origin on it: L heights per pose.
    """
    h1, n, plane = form.axes[0], form.n, form.planar
    sense, side, tilt = np.array(list(product((1.0, -1.0), repeat=3))).T[:, :, None]  # (8, 1) each
    axis = sense[..., None] * tool_axis  # (8, m, 3)
    turned, exists = _between(n, h1, float(form.axes[3] @ n), axis @ h1, side)
    pitch = _bearing(form, turned) - _bearing(form, form.axes[3])
    fore = (plane.upper_angle + plane.elbow_angle + pitch)[..., None]  # direction of the forearm, from up to forward
    lean = float(n @ h1)
    across = n - lean * h1
    length = float(np.linalg.norm(across))
    offset = (form.offset - lean * along) / length
    height = along * float(form.up @ h1) + offset * float(form.up @ across) / length
    cosine = (height - plane.shoulder[1] - plane.fore * np.cos(fore)) / plane.upper
    upper = tilt[..., None] * np.arccos(np.clip(cosine, -1.0, 1.0))
    front = plane.shoulder[0] + plane.upper * np.sin(upper) + plane.fore * np.sin(fore)
    wrist = along[..., None] * h1 + offset[..., None] * (across / length) + front[..., None] * form.forward
    exists = exists[..., None] & (np.abs(cosine) <= 1.0)
    aligned = (sense[..., None] > 0.0) != form.flipped_zero
    second, third = upper - plane.upper_angle, fore - upper - plane.elbow_angle
    fifth = np.broadcast_to(form.wrist_zero + np.where(aligned, 0.0, np.pi), upper.shape)
    return StraightWrists(
        wrist=_turned(wrist, h1, turned, axis),
        shoulder=np.sign(front).astype(np.int64) * exists,
        elbow=-np.sign(front * np.sin(fore - upper)).astype(np.int64) * exists,
        joints=np.stack([form.turns[1] * second, form.turns[2] * third, fifth]),
    )


def _between(n: Floats, h1: Floats, on_n: float, on_h1: Floats, side: Floats) -> tuple[Floats, Bools]:
    """Unit vectors (8, m, 3) with given components on n and h1 (8, m), on one side of their plane; where they exist."""
    c = float(n @ h1)
    x, y = (on_n - c * on_h1) / (1.0 - c * c), (on_h1 - c * on_n) / (1.0 - c * c)
    square = 1.0 - x * x - y * y - 2.0 * c * x * y
    out = side * np.sqrt(np.maximum(square, 0.0))
    normal = np.cross(n, h1) / np.sqrt(1.0 - c * c)
    return x[..., None] * n + y[..., None] * h1 + out[..., None] * normal, square >= 0.0


def _bearing(form: ClosedForm, vectors: Floats) -> Floats:
    """Angle (...) of vectors (..., 3) in the plane of the arm, from up towards forward."""
    angle: Floats = np.arctan2(vectors @ form.forward, vectors @ form.up)
    return angle


def _turned(vectors: Floats, axis: Floats, start: Floats, end: Floats) -> Floats:
    """``vectors`` (8, m, L, 3) turned about ``axis`` by the angle that takes ``start`` (8, m, 3) over ``end``."""
    sine = np.cross(start, end) @ axis
    cosine = np.sum(start * end, axis=-1) - (start @ axis) * (end @ axis)
    angle = np.arctan2(sine, cosine)[..., None, None]
    rest = vectors - (vectors @ axis)[..., None] * axis
    turned: Floats = vectors - rest + np.cos(angle) * rest + np.sin(angle) * np.cross(axis, rest)
    return turned
