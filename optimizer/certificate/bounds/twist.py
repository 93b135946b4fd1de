r"""What joints 4 and 6 of a spherical wrist cost together where their axes align.

At q5 = 0 (counted from where axes 4 and 6 align) either joint may take any value, but not both: only their sum turns
the flange. Looked at one by one they would cost nothing, and boxes around a singular posture would never get a useful
bound however small they are. For a wrist whose neighbouring axes are perpendicular, the rotation M that the wrist has
to make, in the axes (t, b, a) before and behind it, is of the Euler type z-y-z, M = Rz(q4) Ry(q̂) Rz(q6), so

    (1 + cos q̂) e^{i(q4 + q6)} = M11 + M22 + i (M21 - M12),
    (1 - cos q̂) e^{i(q4 - q6)} = M22 - M11 - i (M21 + M12).

As a quaternion, M is a point of the unit sphere in four dimensions; half the sum is its azimuth in a plane on which its
projection has length cos(q̂/2), half the difference that in the plane across, with length sin(q̂/2). Where M turns by
at most δ over a box the point moves by at most δ/2, so the half azimuth changes by at most ``asin(sin(δ/2) / length)``.
The longer projection is taken: the sum near q̂ = 0, the difference near π.

For a sum S ± r the least of ``w4 x² + w6 y²`` (x, y the errors of q4 and q6) with x + y within r of c = S - q4* - q6*
and y between limits is a convex problem in y alone: clip its free minimiser.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.angles.allowance import SINE
from duocell.optimizer.certificate.bounds.angles.joints import SLACK, Angles, Kinematics
from duocell.optimizer.certificate.bounds.angles.wrist import combined
from duocell.optimizer.certificate.bounds.ball import ANYTHING, Ball
from duocell.optimizer.certificate.bounds.rules import Rules

MOST_TURNS = 8
"""Pairs of joints with room for more turns than this are bounded without their limits."""


@dataclass(frozen=True, eq=False, slots=True)
class Twist:
    """Sum of q4 and q6, or their difference, over each box and pose (N, m).

    Attributes:
        value: rad, modulo 2π.
        sense: +1 for q4 + q6, -1 for q4 - q6.
    """

    value: Ball
    sense: Floats


def twist_of(kinematics: Kinematics, angles: Angles) -> Twist:
    """Enclose the sum or the difference of joints 4 and 6."""
    first, pitch = angles.place.first, kinematics.pitch(angles.triangle)
    (m11, m12), (m21, m22) = kinematics.across_wrist(first.centre, pitch.centre)
    sum_, difference = np.hypot(m11 + m22, m21 - m12), np.hypot(m22 - m11, m21 + m12)  # 1 ± cos q̂
    sense = np.where(sum_ >= difference, 1.0, -1.0)
    centre = np.where(sense > 0.0, np.arctan2(m21 - m12, m11 + m22), np.arctan2(-(m21 + m12), m22 - m11))
    length = np.sqrt(0.5 * np.maximum(sum_, difference))
    moved = combined(first.radius, pitch.radius, kinematics.targets.lean) + kinematics.allowance.turn
    turned = np.sin(0.5 * np.minimum(moved, np.pi))
    radius = 2.0 * np.arcsin(np.minimum(turned / length * SINE, 1.0))
    return Twist(Ball(centre, np.where(turned < length, radius + SLACK, ANYTHING)), sense)


def twist_cost(twist: Twist, rules: Rules) -> Floats:
    """(N, m) least weighted cost of joints 4 and 6 together; inf where their limits leave nothing."""
    w4, w6 = float(rules.weights[3]), float(rules.weights[5])
    upright = twist.sense > 0.0
    low_4, high_4 = rules.lower[3] - rules.reference[3], rules.upper[3] - rules.reference[3]
    low_6 = np.where(upright, rules.lower[5] - rules.reference[5], rules.reference[5] - rules.upper[5])
    high_6 = np.where(upright, rules.upper[5] - rules.reference[5], rules.reference[5] - rules.lower[5])
    wanted = twist.value.centre - rules.reference[3] - twist.sense * rules.reference[5]
    radius = twist.value.radius
    room = (high_4 - low_4) + (rules.upper[5] - rules.lower[5])
    if not room / TURN + 3.0 <= MOST_TURNS:
        nearest = wanted - TURN * np.round(wanted / TURN)
        return _least(nearest, radius, w4, w6, np.full_like(wanted, -np.inf), np.full_like(wanted, np.inf))
    first = np.ceil((low_4 + low_6 - radius - wanted) / TURN)
    best = np.full(wanted.shape, np.inf)
    for k in range(int(room / TURN) + 3):
        sum_ = wanted + TURN * (first + k)
        low, high = np.maximum(low_6, sum_ - radius - high_4), np.minimum(high_6, sum_ + radius - low_4)
        best = np.minimum(best, _least(sum_, radius, w4, w6, low, high))
    return np.where(radius >= np.pi, 0.0, best)


def _least(sum_: Floats, radius: Floats, w4: float, w6: float, low: Floats, high: Floats) -> Floats:
    """Least ``w4 x² + w6 y²`` with x + y within ``radius`` of ``sum_`` and y in [low, high]; inf if that is empty."""
    short = np.sign(sum_) * np.maximum(np.abs(sum_) - radius, 0.0)
    y = np.clip(short * (w4 / max(w4 + w6, 1e-300)), low, np.maximum(low, high))
    x = np.maximum(np.abs(sum_ - y) - radius, 0.0)
    cost: Floats = np.where(low <= high, w4 * x**2 + w6 * y**2, np.inf)
    return cost
