r"""The last three angles: a first axis a, then axes 5 and 6, when the whole has to make a given rotation.

For a spherical wrist a is axis 4 and what happens before it is the turn (q1, pitch); for three parallel axes a is
their direction n, the first angle is the pitch, and what happens before is q1 alone.

At zero, with c4 = a·h5, c6 = h5·h6 and s4, s6 the sines: u = (a - c4 h5)/s4, t = h5 x u, b = a x t, and q̂ = q5 - zero,

    Rot(h5, q5) h6 = c6 h5 + s6 (cos q̂ u + sin q̂ t),     cos Θ = c4 c6 + s4 s6 cos q̂

with Θ the angle between a and axis 6. All catalogue wrists have c4 = c6 = 0, so Θ = |q̂|.

The first angle is the azimuth about a (from t to b) of axis 6, seen from the link before the wrist, minus that of
Rot(h5, q5) h6, which is ``atan2(c6 s4 - s6 c4 cos q̂, s6 sin q̂)``; q6 is, with the other sign, the same seen from the
tool: 4 and 6 exchanged, t replaced by -t.

With ωa, ωt, ωb the components on a, t, b of the rate of turn before the wrist and q the first angle,
τ = cos q ωt + sin q ωb and κ = cos q ωb - sin q ωt are those on the turned t and b. How values, slopes (rates that
cancel ω) and second differentials are enclosed is derived in docs/method.md, section 7.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.kinematics.closed_form import ClosedForm
from duocell.optimizer.certificate.bounds.angles.allowance import SINE
from duocell.optimizer.certificate.bounds.ball import ANYTHING, Ball, bearing, cos_sin, reciprocal

POLE = 1e-5
"""rad; directions nearer than this to the axis they turn about count as on it: azimuths are off by 1e-15 over it."""


@dataclass(frozen=True, eq=False, slots=True)
class Wrist:
    """Constants of the last three joints.

    Attributes:
        first: (3, 3) rows a, t, b. last: (3, 3) rows h6, t6, b6: the same triple seen from axis 6.
        c4, s4, c6, s6: cosines and sines between neighbouring axes.
        zero: rad, value of q5 at which u and the part of h6 across h5 agree.
        sense: sign of sin q̂ for the wrist sign +1.
    """

    first: Floats
    last: Floats
    c4: float
    s4: float
    c6: float
    s6: float
    zero: float
    sense: int

    @staticmethod
    def of(form: ClosedForm) -> Wrist:
        """The wrist of a robot."""
        a = form.axes[3] if form.kind == "spherical-wrist" else form.n
        h5, h6 = form.axes[4], form.axes[5]
        first, last = _triple(a, h5), _triple(h6, h5)
        c4, c6 = float(a @ h5), float(h6 @ h5)
        zero = form.wrist_zero - np.pi * form.flipped_zero
        sense = -1 if form.flipped_zero else 1
        return Wrist(first, last, c4, float(np.sqrt(1 - c4 * c4)), c6, float(np.sqrt(1 - c6 * c6)), zero, sense)

    @property
    def cone(self) -> tuple[float, float]:
        """rad, the smallest angle between a and axis 6; the sum of their angles with axis 5, or what it lacks of 2π."""
        one, other = np.arctan2(self.s4, self.c4), np.arctan2(self.s6, self.c6)
        return float(abs(one - other)), float(one + other)

    @property
    def square(self) -> bool:
        """True if neighbouring axes are perpendicular (to rounding), as in every common wrist."""
        return max(abs(self.c4), abs(self.c6)) < 1e-12


def _triple(axis: Floats, h5: Floats) -> Floats:
    """Rows (axis, t, b) with t = h5 x axis normalised and b = axis x t."""
    t = np.cross(h5, axis)
    t /= np.linalg.norm(t)
    return np.array([axis, t, np.cross(axis, t)])


def swing(turn: Floats, tilt: Floats | float) -> Floats:
    """Angle by which a turn of at most ``turn`` rad moves a direction at angle ``asin(tilt)`` from its axis."""
    moved: Floats = 2.0 * np.arcsin(np.minimum(np.sin(0.5 * np.minimum(turn, np.pi)) * tilt * SINE, 1.0))
    return moved


def combined(one: Floats, other: Floats, lean: float) -> Floats:
    """Angle of the rotation made of two turns about axes whose directions have cosine ``lean``, each within its bound.

    From the scalar part of the product of their quaternions, by what is left to 1: of turns below 1e-8 rad, by which
    boxes of 10 nm move a wrist, the cosine is 1 to rounding, and the angle would be lost.
    """
    one, other = 0.5 * np.minimum(one, np.pi), 0.5 * np.minimum(other, np.pi)
    first, second = np.sin(0.5 * one) ** 2, np.sin(0.5 * other) ** 2
    versine = 2.0 * (first + second) - 4.0 * first * second + abs(lean) * np.sin(one) * np.sin(other)
    angle: Floats = 4.0 * np.arcsin(np.sqrt(0.5 * np.clip(versine, 0.0, 1.0)))
    return angle


def wrist_values(
    wrist: Wrist, seen: Floats, fore: Floats, moves: tuple[Floats, Floats], sign: Floats
) -> tuple[Ball, Ball, Ball, Floats]:
    """Enclose the first angle, q5 and q6 over each box and pose (N, m), and how far it is outside of its cone [rad].

    Args:
        wrist: constants.
        seen: (3, N, m) components on a, t, b of axis 6 seen from the link before the wrist, in the middle.
        fore: (2, N, m) components on t6, b6 of a seen from the tool, in the middle.
        moves: (N, m) rad, δ of the former and of the latter.
        sign: (N, 1) sign of the wrist.
    """
    theta = np.arctan2(np.hypot(seen[1], seen[2]), seen[0])  # as near to straight as anywhere, which arccos is not
    low, high = (np.clip(theta + k * np.minimum(*moves), 0.0, np.pi) for k in (-1.0, 1.0))
    bend = Ball.between(_bend(wrist, low), _bend(wrist, high))
    narrowest, widest = wrist.cone
    short = np.maximum(np.maximum(narrowest - high, low - min(widest, 2.0 * np.pi - widest)), 0.0)
    sense = wrist.sense * sign
    room, tilt = np.minimum(theta, np.pi - theta), np.sin(theta)
    azimuths = []
    for (along, beside), move in zip((seen[1:], fore), moves, strict=True):
        loose = (move >= room) | (tilt < POLE)
        sine = np.sin(np.minimum(move, 0.5 * np.pi)) / np.where(loose, 1.0, tilt)
        spread = np.arcsin(np.minimum(sine * SINE, 1.0))
        azimuths.append(Ball(np.arctan2(beside, along), np.where(loose, ANYTHING, spread)))
    own = _own_azimuths(wrist, bend * sense, sense)
    return azimuths[0] - own[0], bend * sense + wrist.zero, own[1] - azimuths[1], short


def _bend(wrist: Wrist, theta: Floats) -> Floats:
    """|q̂| from the angle between a and axis 6; grows with it."""
    if wrist.square:
        return theta
    narrowest, widest = wrist.cone  # cos² and sin² of |q̂|/2, times s4 s6: near 0 and π a cosine would not tell
    square = np.sin(0.5 * (theta + narrowest)) * np.sin(0.5 * (theta - narrowest))
    other = np.sin(0.5 * (widest + theta)) * np.sin(0.5 * (widest - theta))
    bend: Floats = 2.0 * np.arctan2(np.sqrt(np.maximum(square, 0.0)), np.sqrt(np.maximum(other, 0.0)))
    return bend


def _own_azimuths(wrist: Wrist, turn: Ball, sense: Floats) -> tuple[Ball, Ball]:
    """Azimuth about a of Rot(h5, q5) h6, and azimuth about h6 of Rot(h5, -q5) a, for q̂ = ``turn``."""
    if wrist.square:
        ahead, behind = np.where(sense > 0, 0.0, np.pi), np.where(sense > 0, np.pi, 0.0)
        return Ball(ahead, np.zeros_like(ahead)), Ball(behind, np.zeros_like(behind))
    cos, sin = cos_sin(turn)
    one = bearing(sin * wrist.s6, cos * (-wrist.s6 * wrist.c4) + wrist.c6 * wrist.s4)
    other = bearing(sin * -wrist.s4, cos * (-wrist.s4 * wrist.c6) + wrist.c4 * wrist.s6)
    return one, other


@dataclass(frozen=True, eq=False, slots=True)
class WristRates:
    """What the rates of the three angles need to be known about the posture, per box and pose (N, m).

    Attributes:
        cos, sin: of the first angle. cot, csc, cos_bend: of q̂.
        regular: True where q̂ stays away from 0 and π; elsewhere the rates mean nothing.
    """

    wrist: Wrist
    cos: Ball
    sin: Ball
    cot: Ball
    csc: Ball
    cos_bend: Ball
    regular: Bools

    def __getitem__(self, rows: Bools) -> WristRates:
        cos, sin, cot, csc, bend = (b[rows] for b in (self.cos, self.sin, self.cot, self.csc, self.cos_bend))
        return WristRates(self.wrist, cos, sin, cot, csc, bend, self.regular[rows])

    @staticmethod
    def at(wrist: Wrist, first: Ball, fifth: Ball, sign: Floats) -> WristRates:
        """Prepare for enclosed angles (N, m) and the sign of the wrist (N, 1)."""
        sense = wrist.sense * sign
        bend = (fifth - wrist.zero) * sense
        low, high = bend.low, bend.high
        least = np.minimum(np.sin(low), np.sin(high))
        regular = (low > 0.0) & (high < np.pi) & (least > POLE)
        low, high = np.where(regular, low, 0.5 * np.pi), np.where(regular, high, 0.5 * np.pi)
        most = np.where((low < 0.5 * np.pi) & (high > 0.5 * np.pi), 1.0, np.maximum(np.sin(low), np.sin(high)))
        cos, sin = cos_sin(first)
        return WristRates(
            wrist=wrist,
            cos=cos,
            sin=sin,
            cot=Ball.between(1.0 / np.tan(high), 1.0 / np.tan(low)) * sense,
            csc=reciprocal(np.where(regular, least, 1.0), most) * sense,
            cos_bend=Ball.between(np.cos(high), np.cos(low)),
            regular=regular,
        )

    def cancelling(self, along: Ball | float, across: tuple[Ball | float, Ball | float]) -> tuple[Ball, Ball, Ball]:
        """Rates (N, m) of the first angle, q5 and q6 that cancel a turn with components ωa and (ωt, ωb)."""
        wrist = self.wrist
        tau = self.cos * across[0] + self.sin * across[1]
        kappa = self.cos * across[1] - self.sin * across[0]
        first = self.cot * tau
        fifth = kappa * (-1.0 / wrist.s4)
        if not wrist.square:
            first = (first + kappa * wrist.c4) * (1.0 / wrist.s4)
            fifth = fifth + (self.cos_bend * (-wrist.c4 / wrist.s4) + wrist.c6 / wrist.s6) * self.csc * tau
        return first - along, fifth, self.csc * tau * (-1.0 / wrist.s6)

    def bending(self, first: Floats, fifth: Floats, sixth: Floats) -> tuple[Floats, Floats, Floats]:
        """Largest own second differentials (N, m), given the largest first ones of the three angles."""
        wrist, csc, cot = self.wrist, self.csc.size, self.cot.size
        kappa, g = wrist.s4 * fifth, np.zeros(1)
        if not wrist.square:
            g = (self.cos_bend * (-wrist.c4 / wrist.s4) + wrist.c6 / wrist.s6).size
            kappa = kappa + wrist.s4 * wrist.s6 * g * sixth
        turning = abs(wrist.c4) * wrist.s6 * sixth * first
        return (
            (wrist.s6 * csc * fifth * sixth + cot * kappa * first + turning) / wrist.s4,
            (wrist.s6 * sixth * first + abs(wrist.c4) * wrist.s6 * fifth * sixth) / wrist.s4
            + g * (cot * wrist.s6 * fifth * sixth + csc * kappa * first),
            (csc * kappa * first + wrist.s6 * cot * fifth * sixth) / wrist.s6,
        )
