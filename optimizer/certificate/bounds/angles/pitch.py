r"""Where axis 6 of a three-parallel-axes arm comes near the direction n of the three: four joints by the pitch.

At q5 = 0 the pitch p of the hand is free, and q6 with it. Looked at one by one the four joints that depend on p would
cost nothing in a box around such a place, however small it is. But they hang together:

*Sum.* As for a spherical wrist (`twist`) the rotation M that the hand has to make after joint 1 is of the Euler type
z-y-z in the axes (t, b, n), so p + q6 near q̂ = 0, or p - q6 near π, is as narrow as q1: `pitch_sum`.

*Given p*, the hand's offset and with it the end of the triangle are known: q2, q3, q4 = p - (q2 + q3) and q6.

*Away from the singularity* p has two values. Let axis 6 rise by e over the base plane and be at an angle θ from n, and
let n be level (n·h1 = 0). Its components on (n, t, b) are cos θ and sin θ times cosine and sine of its azimuth; its
component along h1 is sin e whatever the base, so with A the azimuth of h1

    azimuth = A ± acos(sin e / sin θ),        p = azimuth - (0 where q̂ > 0, π where q̂ < 0).

Where θ keeps a distance from 0 and π, by rule of the product (`duocell.models.kinematics.wrist_singularity`), sin e /
sin θ has narrow bounds, and p is in two narrow intervals. Without the rule p is cut into cells over all that it may be.

Neighbouring axes are perpendicular up to c4 and c6, at most `SQUARE`. Terms of M change by at most 2 (|c4| + |c6|), its
sums, of length 1 at least, by twice that; the azimuth of Rot(h5, q5) h6 by (|c4| + |c6|) / sin θ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.angles.allowance import SINE
from duocell.optimizer.certificate.bounds.angles.joints import SLACK, Angles, Kinematics
from duocell.optimizer.certificate.bounds.angles.triangle import triangle_values
from duocell.optimizer.certificate.bounds.angles.wrist import swing
from duocell.optimizer.certificate.bounds.ball import ANYTHING, Ball, cos_sin
from duocell.optimizer.certificate.bounds.boxes import Boxes

SQUARE = 1e-5
"""Largest cosine between neighbouring axes of the wrist, and between n and the base plane."""
CELLS = 48
"""Parts of the pitch where it is free."""
ROUNDING = 1e-13
"""Of sin e."""


@dataclass(frozen=True, eq=False, slots=True)
class PitchCells:
    """Joints 2, 3, 4 and 6 of Q pairs of a box and a pose over C parts of the pitch.

    Attributes:
        values: (4, Q, C) rad, modulo 2π.
        alive: (Q, C) False where the part holds nothing: out of reach, out of the pitch known, or singular.
        singular: (Q,) True where the wrist is too near to its singularity all over the box.
    """

    values: Ball
    alive: Bools
    singular: Bools


def has_free_pitch(kinematics: Kinematics) -> bool:
    """True for three parallel axes with a square wrist and level n: UR and many others."""
    wrist = kinematics.wrist
    return not kinematics.spherical and max(abs(wrist.c4), abs(wrist.c6), abs(kinematics.targets.lean)) < SQUARE


def pitch_cells(
    kinematics: Kinematics, boxes: Boxes, angles: Angles, pairs: tuple[Ints, Ints], smallest: float
) -> PitchCells:
    """Enclose joints 2, 3, 4 and 6 of chosen boxes and poses.

    Args:
        kinematics: see `has_free_pitch`.
        boxes: along the mount's axes. angles: over them.
        pairs: (Q,) boxes and (Q,) poses.
        smallest: rad, distance that the wrist keeps from its singularity; 0 for none.
    """
    box, pose = pairs
    form, planar = kinematics.targets.form, kinematics.targets.form.planar
    known = Ball(angles.turn.centre[box, pose], np.minimum(angles.turn.radius[box, pose], np.pi))
    if smallest > 0.0:
        pitch, alive = _two_values(kinematics, boxes, angles, pairs, smallest)
        singular: Bools = ~np.any(alive, axis=1)
        off = pitch.centre - known.centre[:, None]
        off = off - TURN * np.round(off / TURN)
        alive &= np.abs(off) <= known.radius[:, None] + pitch.radius
        pitch = Ball(known.centre[:, None] + off, pitch.radius)
    else:
        share = (np.arange(CELLS) + 0.5) / CELLS * 2.0 - 1.0
        centre = known.centre[:, None] + known.radius[:, None] * share
        pitch = Ball(centre, np.broadcast_to(known.radius[:, None] / CELLS + SLACK, centre.shape))
        alive = np.ones(centre.shape, dtype=np.bool_)
        singular = np.zeros(len(box), dtype=np.bool_)
    bend = (-boxes.sign(0) * boxes.sign(1))[box]
    (hx, hy), (cos, sin) = planar.hand, cos_sin(pitch)
    x = _column(angles.place.front, pairs) - planar.shoulder[0] - (cos * hx + sin * hy)
    y = _column(angles.place.height, pairs) - planar.shoulder[1] - (cos * hy - sin * hx)
    triangle = triangle_values(planar, x, y, bend)
    total, sense = pitch_sum(kinematics, angles.place.first, pairs)
    joints = (
        (triangle.upper - planar.upper_angle) * form.turns[1],
        (triangle.elbow * bend - planar.elbow_angle) * form.turns[2],
        (pitch - triangle.fore + (planar.upper_angle + planar.elbow_angle)) * form.turns[3],
        (total - pitch) * sense,
    )
    centres = np.stack([ball.centre for ball in joints])
    radii = np.stack([np.broadcast_to(ball.radius, centres.shape[1:]) for ball in joints])
    return PitchCells(Ball(centres, radii + SLACK), alive & (triangle.short <= SLACK), singular)


def _column(values: Ball, pairs: tuple[Ints, Ints]) -> Ball:
    """(Q, 1) of chosen boxes and poses."""
    box, pose = pairs
    radius = np.broadcast_to(values.radius, values.centre.shape)
    return Ball(values.centre[box, pose][:, None], radius[box, pose][:, None])


def pitch_sum(kinematics: Kinematics, first: Ball, pairs: tuple[Ints, Ints]) -> tuple[Ball, Floats]:
    """(Q, 1) ``p + sense q6`` modulo 2π, and (Q, 1) sense ±1; see `has_free_pitch`."""
    box, pose = pairs
    (m11, m12), (m21, m22) = kinematics.across_wrist(first.centre, np.zeros_like(first.centre))
    m11, m12, m21, m22 = (entry[box, pose] for entry in (m11, m12, m21, m22))
    sum_, difference = np.hypot(m11 + m22, m21 - m12), np.hypot(m22 - m11, m21 + m12)  # 1 ± cos q̂
    sense = np.where(sum_ >= difference, 1.0, -1.0)
    centre = np.where(sense > 0.0, np.arctan2(m21 - m12, m11 + m22), np.arctan2(-(m21 + m12), m22 - m11))
    length = np.sqrt(0.5 * np.maximum(sum_, difference))
    turned = np.sin(0.5 * np.minimum(first.radius[box, pose] + kinematics.allowance.turn, np.pi))
    loose = 8.0 * (abs(kinematics.wrist.c4) + abs(kinematics.wrist.c6)) + SLACK
    radius = np.where(turned < length, 2.0 * np.arcsin(np.minimum(turned / length * SINE, 1.0)) + loose, ANYTHING)
    return Ball(centre[:, None], radius[:, None]), sense[:, None]


def _two_values(
    kinematics: Kinematics, boxes: Boxes, angles: Angles, pairs: tuple[Ints, Ints], smallest: float
) -> tuple[Ball, Bools]:
    """(Q, 2) the two intervals of the pitch, and (Q, 2) False where the wrist is too near to its singularity."""
    box, pose = pairs
    targets, wrist, first = kinematics.targets, kinematics.wrist, angles.place.first
    h1, (n, t, b) = targets.form.axes[0], wrist.first
    rise = (targets.last_axis @ h1)[pose]
    turn, radius = first.centre[box, pose], first.radius[box, pose]
    # axis 6 seen from the link after joint 1: n·Rot(h1, -q1) z6 = Rot(h1, q1) n · z6
    cos, sin = np.cos(targets.sigma * turn), np.sin(targets.sigma * turn)
    level = np.array([n[0] * cos - n[1] * sin, n[0] * sin + n[1] * cos, np.broadcast_to(n[2], cos.shape)])
    level, last = level.T, targets.last_axis[pose]
    theta = np.arctan2(np.linalg.norm(np.cross(level, last), axis=1), np.sum(level * last, axis=1))
    move = swing(radius, np.linalg.norm(np.cross(last, h1), axis=1)) + SLACK + kinematics.allowance.turn
    keep = smallest - SQUARE
    low, high = np.maximum(theta - move, keep), np.minimum(theta + move, np.pi - keep)
    dead = low > high
    low, high = np.where(dead, 0.5 * np.pi, low), np.where(dead, 0.5 * np.pi, high)
    least = np.minimum(np.sin(low), np.sin(high))
    most = np.where((low < 0.5 * np.pi) & (high > 0.5 * np.pi), 1.0, np.maximum(np.sin(low), np.sin(high)))
    ends = rise / least, rise / most
    loose = (abs(targets.lean) + ROUNDING + kinematics.allowance.turn) / least
    narrow = np.arccos(np.clip(np.maximum(*ends) + loose, -1.0, 1.0))
    wide = np.arccos(np.clip(np.minimum(*ends) - loose, -1.0, 1.0))
    spread, half = 0.5 * (narrow + wide), 0.5 * (wide - narrow)
    half = half + 4.0 * (abs(wrist.c4) + abs(wrist.c6)) / least + SLACK
    own = np.where(wrist.sense * boxes.sign(2)[box, 0] > 0.0, 0.0, np.pi)
    start = np.arctan2(float(h1 @ b), float(h1 @ t)) - own
    alive = np.broadcast_to(~dead[:, None], (len(box), 2)).copy()
    return Ball(np.stack([start + spread, start - spread], axis=1), half[:, None]), alive
