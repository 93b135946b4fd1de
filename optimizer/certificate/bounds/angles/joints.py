r"""All six joints over a box of base positions, for both classes of arms.

Spherical wrist: q1 and the place of the wrist point (`front`), the triangle to it (`triangle`), which gives q2, q3
and the pitch of the forearm, then the wrist (`wrist`), turned before it by q1 about h1 and by the pitch about n.

Three parallel axes: q1 (`front`), then the wrist, turned before it by q1 alone: it gives the pitch p of the hand, q5
and q6. The triangle ends where the hand begins,

    X = f - (hx cos p + hy sin p) - shoulder_x,   Y = height - (hy cos p - hx sin p) - shoulder_y,

with (hx, hy) the hand at p = 0, and ``q4 = p - (q2 + q3)`` up to the senses of the axes (docs/method.md, section 7.5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.optimizer.certificate.bounds.angles.allowance import NONE, Allowance
from duocell.optimizer.certificate.bounds.angles.front import (
    Front,
    FrontSlopes,
    front_bending,
    front_slopes,
    front_values,
)
from duocell.optimizer.certificate.bounds.angles.targets import Targets
from duocell.optimizer.certificate.bounds.angles.triangle import (
    FLAT,
    Triangle,
    TriangleSlopes,
    sine_range,
    triangle_bending,
    triangle_slopes,
    triangle_values,
)
from duocell.optimizer.certificate.bounds.angles.wrist import Wrist, WristRates, combined, swing, wrist_values
from duocell.optimizer.certificate.bounds.ball import Ball, cos_sin, stacked
from duocell.optimizer.certificate.bounds.boxes import Boxes

SLACK = 1e-9
"""rad and m left around every enclosure: for rounding, and for constants of robots that are known to as much."""


Rates = tuple[Ball, ...]
"""Rates of the wrist's three angles."""


@dataclass(frozen=True, eq=False, slots=True)
class Angles:
    """The geometry's own angles [rad] over each box and pose (N, m).

    Attributes:
        place: joint 1 and the wrist point.
        triangle: upper arm, forearm, elbow.
        turn: first angle of the wrist: q4, or the pitch of the hand. fifth, sixth: q5, q6.
        wrist_short: (N, m) rad, how far an oblique wrist is from being able to turn there.
    """

    place: Front
    triangle: Triangle
    turn: Ball
    fifth: Ball
    sixth: Ball
    wrist_short: Floats

    @property
    def short(self) -> Floats:
        """(N, m) m or rad, how far the pose is from being reached from anywhere in the box."""
        short: Floats = self.triangle.short + self.place.short + self.wrist_short
        return short

    def __getitem__(self, rows: Bools) -> Angles:
        wrist = self.turn[rows], self.fifth[rows], self.sixth[rows], self.wrist_short[rows]
        return Angles(self.place[rows], self.triangle[rows], *wrist)


@dataclass(frozen=True, eq=False, slots=True)
class AngleSlopes:
    """Derivatives of the `Angles` with respect to the base position: balls (K, N, m), in rad/m or plain."""

    place: FrontSlopes
    triangle: TriangleSlopes
    wrist: tuple[Ball, Ball, Ball]
    rates: WristRates

    def __getitem__(self, rows: Bools) -> AngleSlopes:
        first, fifth, sixth = (ball[:, rows] for ball in self.wrist)
        return AngleSlopes(self.place[rows], self.triangle[rows], (first, fifth, sixth), self.rates[rows])


@dataclass(frozen=True, eq=False, slots=True)
class Kinematics:
    """Enclosures of one arm's joints for one task; ``allowance``: how far beside it hands may be."""

    targets: Targets
    wrist: Wrist
    allowance: Allowance

    @staticmethod
    def of(targets: Targets) -> Kinematics:
        """For the robot of the targets, with room for rounding."""
        return Kinematics(targets, Wrist.of(targets.form), Allowance.of_rounding(targets))

    @staticmethod
    def of_checks(targets: Targets) -> Kinematics:
        """The same with room for all that a check lets pass: nothing of that may be called impossible.

        Heights count as free: bases may stand as little above or below as beside their region.
        """
        return Kinematics(replace(targets, dims=3), Wrist.of(targets.form), Allowance.of_checks(targets))

    @property
    def exact(self) -> Kinematics:
        """With no room at all: for values at points."""
        return replace(self, allowance=NONE)

    @property
    def spherical(self) -> bool:
        """True for spherical wrists, False for three parallel axes."""
        return self.targets.form.kind == "spherical-wrist"

    @property
    def twists(self) -> bool:
        """True if joints 4 and 6 can turn about the same line."""
        return self.spherical and self.wrist.square

    def angles(self, boxes: Boxes) -> Angles:
        """Enclose the angles over each box, for hands within the allowance of their poses."""
        form = self.targets.form
        boxes = Boxes(boxes.centre, boxes.half + self.allowance.shift, boxes.posture)
        place = front_values(self.targets, boxes)
        bend = -boxes.sign(0) * boxes.sign(1)
        x, y = place.front - form.planar.shoulder[0], place.height - form.planar.shoulder[1]
        if self.spherical:
            triangle = triangle_values(form.planar, x, y, bend)
            return Angles(place, triangle, *self._wrist(place.first, self.pitch(triangle), boxes))
        turn, fifth, sixth, wrist_short = self._wrist(place.first, None, boxes)
        (hx, hy), (cos, sin) = form.planar.hand, cos_sin(turn)
        triangle = triangle_values(form.planar, x - (cos * hx + sin * hy), y - (cos * hy - sin * hx), bend)
        return Angles(place, triangle, turn, fifth, sixth, wrist_short)

    def pitch(self, triangle: Triangle) -> Ball:
        """Turn of the forearm about n since q = 0."""
        return triangle.fore - (self.targets.form.planar.upper_angle + self.targets.form.planar.elbow_angle)

    def _wrist(self, first: Ball, pitch: Ball | None, boxes: Boxes) -> tuple[Ball, Ball, Ball, Floats]:
        """The wrist's three angles after joint 1 and, for spherical wrists, the pitch."""
        targets, wrist = self.targets, self.wrist
        h1, n, a = targets.form.axes[0], targets.form.n, wrist.first[0]
        seen = _turned_level(targets.last_axis.T[:, None], -targets.sigma * first.centre)
        axis = np.broadcast_to(a[:, None, None], seen.shape)
        move = swing(first.radius, np.linalg.norm(np.cross(targets.last_axis, h1), axis=-1))
        moves = move, swing(first.radius, targets.level)
        if pitch is not None:
            seen, axis = _turned(seen, n, -pitch.centre), _turned(axis, n, pitch.centre)
            both = combined(first.radius, pitch.radius, targets.lean)
            tilt = float(np.linalg.norm(np.cross(n, a)))
            moves = np.minimum(both, move + pitch.radius), np.minimum(both, first.radius + swing(pitch.radius, tilt))
        across = np.einsum("jab,kb->kaj", targets.turned, wrist.last[1:])  # t6 and b6 in the world, (2, 3, m)
        fore = np.einsum("kaj,aNj->kNj", across, _turned_level(axis, targets.sigma * first.centre))
        moves = moves[0] + self.allowance.turn, moves[1] + self.allowance.turn
        return wrist_values(wrist, np.tensordot(wrist.first, seen, 1), fore, moves, boxes.sign(2))

    def across_wrist(self, first: Floats, pitch: Floats) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Of the rotation that a spherical wrist makes: rows t and b before it, columns t6 and b6 behind it (N, m)."""
        targets, wrist = self.targets, self.wrist
        n = targets.form.n
        columns = []
        for axis in wrist.last[1:]:
            behind = (targets.turned @ axis).T[:, None]
            seen = _turned(_turned_level(behind, -targets.sigma * first), n, -pitch)
            columns.append(np.tensordot(wrist.first[1:], seen, 1))
        (m11, m21), (m12, m22) = columns
        return (m11, m12), (m21, m22)

    def joint_values(self, angles: Angles) -> Ball:
        """(6, N, m) rad, joint values at yaw 0, modulo 2π."""
        form, triangle = self.targets.form, angles.triangle
        turns, upper_angle, elbow_angle = form.turns, form.planar.upper_angle, form.planar.elbow_angle
        second = (triangle.upper - upper_angle) * turns[1]
        third = (triangle.elbow * triangle.bend - elbow_angle) * turns[2]
        fourth = angles.turn
        if not self.spherical:
            fourth = (angles.turn - triangle.fore + (upper_angle + elbow_angle)) * turns[3]
        return stacked([angles.place.first, second, third, fourth, angles.fifth, angles.sixth])

    def slopes(self, boxes: Boxes, angles: Angles) -> AngleSlopes:
        """Enclose the slopes, given the enclosed angles."""
        targets, form = self.targets, self.targets.form
        place = front_slopes(targets, angles.place)
        rates = WristRates.at(self.wrist, angles.turn, angles.fifth, boxes.sign(2))
        if self.spherical:
            triangle = triangle_slopes(form.planar, angles.triangle, place.front, place.height)
            by_first, by_pitch, _ = self._wrist_rates(rates, angles)
            wrist = [place.first * one + triangle.fore * other for one, other in zip(by_first, by_pitch, strict=True)]
        else:
            by_first, _, _ = self._wrist_rates(rates, angles)
            wrist = [place.first * one for one in by_first]
            (hx, hy), (cos, sin) = form.planar.hand, cos_sin(angles.turn)
            dx = place.front - wrist[0] * (cos * hy - sin * hx)
            dy = wrist[0] * (sin * hy + cos * hx) + place.height
            triangle = triangle_slopes(form.planar, angles.triangle, dx, dy)
        return AngleSlopes(place, triangle, (wrist[0], wrist[1], wrist[2]), rates)

    def _wrist_rates(self, rates: WristRates, angles: Angles) -> tuple[Rates, Rates, Rates]:
        """What the wrist's angles do per unit of: q1, the pitch, and h1 turned about n as the pitch changes."""
        h1, n, (a, t, b) = self.targets.form.axes[0], self.targets.form.n, self.wrist.first
        if not self.spherical:
            return rates.cancelling(float(h1 @ n), (float(h1 @ t), float(h1 @ b))), (), ()
        lean = self.targets.lean
        cos, sin = cos_sin(self.pitch(angles.triangle))
        # Components of h1 seen from the forearm, and of their derivative with respect to the pitch.
        level = [(float(h1 @ x - lean * (n @ x)), float(h1 @ np.cross(n, x)), lean * float(n @ x)) for x in (a, t, b)]
        along, *across = (cos * p + sin * q + r for p, q, r in level)
        along_turned, *across_turned = (cos * q - sin * p for p, q, _ in level)
        return (
            rates.cancelling(along, (across[0], across[1])),
            rates.cancelling(float(n @ a), (float(n @ t), float(n @ b))),
            rates.cancelling(along_turned, (across_turned[0], across_turned[1])),
        )

    def joint_slopes(self, slopes: AngleSlopes) -> Ball:
        """(6, K, N, m) rad/m, derivatives of the joint values."""
        turns, triangle = self.targets.form.turns, slopes.triangle
        fourth = slopes.wrist[0] if self.spherical else (slopes.wrist[0] - triangle.fore) * turns[3]
        second, third = triangle.upper * turns[1], (triangle.fore - triangle.upper) * turns[2]
        return stacked([slopes.place.first, second, third, fourth, *slopes.wrist[1:]])

    def by_turn(self, angles: Angles, slopes: AngleSlopes) -> Floats:
        """(6, N, m) rad that hands turned as far as allowed change joint values at most, where these are regular.

        Of a turn by a unit vector τ and κ are 1 at most (`wrist`); the wrist point's way is in the allowance's shift.
        """
        wrist, planar, csc = self.wrist, self.targets.form.planar, slopes.rates.csc.size
        oblique = abs(wrist.c6) / wrist.s6 + abs(wrist.c4) / wrist.s4
        first = (slopes.rates.cot.size + abs(wrist.c4)) / wrist.s4 + 1.0
        last = [1.0 / wrist.s4 + oblique * csc, csc / wrist.s6]
        none = np.zeros_like(csc)
        if self.spherical:
            return self.allowance.turn * np.stack([none, none, none, first, *last])
        moved = float(np.hypot(*planar.hand)) * first / np.maximum(sine_range(angles.triangle.elbow)[0], FLAT)
        upper, fore = moved / planar.upper, moved / planar.fore
        return self.allowance.turn * np.stack([none, upper, upper + fore, first + fore, *last])

    def regular(self, slopes: AngleSlopes) -> Bools:
        """(6, N, m) True where the slopes of a joint mean something."""
        place, wrist = slopes.place.regular, slopes.rates.regular
        if self.spherical:
            triangle = place & slopes.triangle.regular
            wrist = triangle & wrist
        else:
            wrist = place & wrist
            triangle = wrist & slopes.triangle.regular
        return np.stack([place, triangle, triangle, wrist & triangle, wrist, wrist])

    def bending(self, angles: Angles, slopes: AngleSlopes, half: Floats) -> Floats:
        """(6, N, m) rad, largest second differential of the joint values for steps of at most ``half`` (N, K) m.

        The steps of docs/method.md, section 7.5, in their order.
        """
        form = self.targets.form

        def largest(slope: Ball) -> Floats:
            step: Floats = np.einsum("KNm,NK->Nm", slope.size, half)
            return step

        first, front = largest(slopes.place.first), largest(slopes.place.front)
        upper, fore = largest(slopes.triangle.upper), largest(slopes.triangle.fore)
        own = slopes.rates.bending(*(largest(slope) for slope in slopes.wrist))
        by_first, by_pitch, by_both = self._wrist_rates(slopes.rates, angles)
        first_2, front_2 = front_bending(self.targets, angles.place, first, front, half)  # step 1
        if self.spherical:  # step 2
            upper_2, fore_2 = triangle_bending(form.planar, angles.triangle, upper, fore, front_2, np.zeros(1))
            wrist_2 = [
                q + one.size * first_2 + other.size * fore_2 + both.size * first * fore
                for q, one, other, both in zip(own, by_first, by_pitch, by_both, strict=True)
            ]
            fourth_2 = wrist_2[0]
        else:  # step 3
            wrist_2 = [q + one.size * first_2 for q, one in zip(own, by_first, strict=True)]
            (hx, hy), (cos, sin), turn = form.planar.hand, cos_sin(angles.turn), largest(slopes.wrist[0])
            out, up = (cos * hx + sin * hy).size, (cos * hy - sin * hx).size
            dx, dy = front_2 + up * wrist_2[0] + out * turn**2, out * wrist_2[0] + up * turn**2
            upper_2, fore_2 = triangle_bending(form.planar, angles.triangle, upper, fore, dx, dy)
            fourth_2 = wrist_2[0] + fore_2
        return np.stack([first_2, upper_2, upper_2 + fore_2, fourth_2, *wrist_2[1:]])  # step 4


def _turned_level(vectors: Floats, angle: Floats) -> Floats:
    """Vectors (3, ...) turned about the base's z axis by angles (N, m)."""
    (x, y, z), cos, sin = vectors, np.cos(angle), np.sin(angle)
    return np.stack([x * cos - y * sin, x * sin + y * cos, np.broadcast_to(z, angle.shape)])


def _turned(vectors: Floats, axis: Floats, angle: Floats) -> Floats:
    """Rodrigues: vectors (3, N, m) turned about a fixed unit axis (3,) by angles (N, m)."""
    cos, sin = np.cos(angle), np.sin(angle)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    along = np.tensordot(np.outer(axis, axis), vectors, 1)
    turned: Floats = along + (vectors - along) * cos + np.tensordot(skew, vectors, 1) * sin
    return turned
