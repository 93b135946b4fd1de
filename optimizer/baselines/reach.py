"""How far a base may move before the inverse kinematics of a posture cease to exist.

The source guards with ``Rmin <= |p_j| <= Rmax`` on the flange. These two spheres contain the domain of the inverse
kinematics but are larger than it, because they do not know the orientation. The rows below are the domain itself: the
two-link triangle can be closed and the wrist is not inside the cylinder about axis 1 that the shoulder offset keeps it
out of. A base yaw moves nothing here, so their gradients are with respect to (x, y, z).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about
from duocell.models.kinematics.closed_form import ClosedForm
from duocell.models.robot.posture import Signs
from duocell.models.robot.robot import Robot

TINY = 1e-12


@dataclass(frozen=True, eq=False, slots=True)
class ReachRows:
    """Constraints ``values <= 0`` [m] of every pose: too far, too near, too close to axis 1.

    Attributes:
        values: (3, m) m. gradients: (3, m, 3) with respect to the base position in the world.
    """

    values: Floats
    gradients: Floats


def reach_rows(form: ClosedForm, rotations: Floats, positions: Floats, joints: Floats, signs: Signs) -> ReachRows:
    """The reach rows of one posture.

    Args:
        form: constants of the arm, whose axis 1 is the vertical through the base origin.
        rotations: (m, 3, 3) flange in world axes.
        positions: (m, 3) m, flange relative to the base origin, in world axes.
        joints: (m, 6) rad, branch of the posture at yaw 0, modulo 2π; clamped where the pose is out of reach.
        signs: shoulder, elbow, wrist.

    Returns:
        Rows; the triangle's are zero with zero gradient where the pose is too close to axis 1 (no triangle exists).
    """
    h1 = form.axes[0]
    wrist = positions + rotations @ form.wrist_in_flange - form.origin  # (m, 3)
    lean = float(form.n @ h1)
    across = form.n - lean * h1
    length = float(np.linalg.norm(across))
    across = across / length
    along, side, front = wrist @ h1, wrist @ across, wrist @ form.forward
    distance = np.maximum(np.hypot(side, front), TINY)
    offset = (form.offset - lean * along) / length
    offset_slope = -lean / length * h1  # (3,)
    distance_slope = (side[:, None] * across + front[:, None] * form.forward) / distance[:, None]
    root = np.sqrt(np.maximum(distance**2 - offset**2, 0.0))
    closed = root > TINY
    ahead = signs[0] * np.where(closed, root, np.inf)  # inf: slopes vanish where there is no triangle
    ahead_slope = (distance[:, None] * distance_slope - offset[:, None] * offset_slope) / ahead[:, None]
    lift = float(form.up @ h1), float(form.up @ across)
    x = signs[0] * root - form.planar.shoulder[0]
    y = along * lift[0] + offset * lift[1] - form.planar.shoulder[1]
    x_slope, y_slope = ahead_slope, lift[0] * h1 + lift[1] * offset_slope
    if form.kind == "three-parallel":
        half_slope = (
            signs[0] * (offset[:, None] * distance_slope / distance[:, None] - offset_slope) / np.abs(ahead[:, None])
        )
        bearing_slope = (front[:, None] * across - side[:, None] * form.forward) / distance[:, None] ** 2
        pitch = joints[:, 1:4] @ form.turns[1:4]
        pitch_slope = _pitch_per_turn(form, pitch, joints[:, 4])[:, None] * (bearing_slope + half_slope)
        cos, sin, hand = np.cos(pitch), np.sin(pitch), form.planar.hand
        x = x - (hand[0] * cos + hand[1] * sin)
        y = y - (hand[1] * cos - hand[0] * sin)
        x_slope = x_slope - (hand[1] * cos - hand[0] * sin)[:, None] * pitch_slope
        y_slope = y_slope + (hand[1] * sin + hand[0] * cos)[:, None] * pitch_slope
    span = np.maximum(np.hypot(x, y), TINY)
    span_slope = (x[:, None] * x_slope + y[:, None] * y_slope) / span[:, None]
    longest, shortest = form.planar.upper + form.planar.fore, abs(form.planar.upper - form.planar.fore)
    outward = np.sign(offset)
    values = np.array([(span - longest) * closed, (shortest - span) * closed, np.abs(offset) - distance])
    gradients = np.array([span_slope, -span_slope, outward[:, None] * offset_slope - distance_slope])
    gradients[:2] *= closed[:, None]
    return ReachRows(values, -gradients)  # the wrist moves against the base


def _pitch_per_turn(form: ClosedForm, pitch: Floats, fifth: Floats) -> Floats:
    """(m,) how the sum of the parallel joints follows joint 1 while the hand keeps its orientation.

    From ``0 = h1 dq1 + n dpitch + a5 dq5 + a6 dq6``: its component along a5 × a6 has only two terms.
    """
    h1, h5, h6, n = form.axes[0], form.axes[4], form.axes[5], form.n
    normal = np.cross(h5, rotation_about(h5, fifth) @ h6)  # in the frame behind the pitch
    first = (rotation_about(n, -pitch) @ h1 * normal).sum(axis=-1)
    against = normal @ n
    ratio: Floats = -first / np.where(np.abs(against) > TINY, against, np.inf)
    return ratio


def reach_range(robot: Robot, form: ClosedForm) -> tuple[float, float]:
    """(Rmin, Rmax) [m] of the source: how near to and how far from its shoulder the flange gets (5.6 to 5.13).

    The wrist's extremes follow from the limits of joint 3; the hand is then pointed inwards or outwards. For the
    source's PUMA this gives 0.290 m and 0.934 m; the source prints 0.306 m, from another triangle, and 0.935 m.
    """
    plane = form.planar
    bend = np.sort(plane.elbow_angle + form.turns[2] * np.array([robot.lower[2], robot.upper[2]]))
    bend = np.where(np.isfinite(bend), bend, [-np.pi, np.pi])
    halves = np.arange(np.ceil(bend[0] / np.pi), np.floor(bend[1] / np.pi) + 1) * np.pi  # straight or folded inside
    cosines = np.cos(np.concatenate([bend, halves]))
    squares = plane.upper**2 + plane.fore**2 + 2.0 * plane.upper * plane.fore * cosines + form.offset**2
    hand = float(np.linalg.norm(form.wrist_in_flange) + np.linalg.norm(plane.hand))
    return max(float(np.sqrt(squares.min())) - hand, 0.0), float(np.sqrt(squares.max())) + hand
