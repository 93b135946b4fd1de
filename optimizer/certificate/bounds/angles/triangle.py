r"""The planar two-link triangle over a rectangle of end points.

Links of lengths a (upper arm) and b (forearm) reach from the shoulder to (X, Y) = (forward, up). Bearings are measured
from up towards forward; with β and ρ bearing and length of (X, Y), ε in [0, π] the bend of the elbow and k = ±1 its
sense, the bearings of upper arm and forearm are

    A = β - k inner(ρ),   B = β + k outer(ρ),   B - A = kε,

where inner and outer are the triangle's angles at its two ends, ``cos ε = (ρ² - a² - b²) / 2ab``,
``cos inner = (ρ² + a² - b²) / 2aρ``, ``cos outer = (ρ² + b² - a²) / 2bρ``.

The arc cosines are as exact as ρ is: what rounding does to it is in the rectangle (`allowance`). How values, slopes and
second differentials are enclosed is derived in docs/method.md, section 7.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.kinematics.closed_form import Planar
from duocell.optimizer.certificate.bounds.ball import Ball, bearing, cos_sin, distances, reciprocal

FLAT = 1e-4
"""Sine of an elbow that counts as straight or folded: its slopes would be of no use."""


@dataclass(frozen=True, eq=False, slots=True)
class Triangle:
    """Values over each box (N) and pose (m).

    Attributes:
        upper: (N, m) rad, A. fore: (N, m) rad, B. elbow: (N, m) rad, ε. bend: (N, 1) k.
        short: (N, m) m, how much too far or too near every end point is.
    """

    upper: Ball
    fore: Ball
    elbow: Ball
    bend: Floats
    short: Floats

    def __getitem__(self, rows: Bools) -> Triangle:
        return Triangle(self.upper[rows], self.fore[rows], self.elbow[rows], self.bend[rows], self.short[rows])


def triangle_values(planar: Planar, x: Ball, y: Ball, bend: Floats) -> Triangle:
    """Enclose the triangle's angles for end points in the rectangle x, y (N, m), relative to the shoulder."""
    a, b = planar.upper, planar.fore
    near, far = distances(x, y)
    short = np.maximum(near - (a + b), 0.0) + np.maximum(abs(a - b) - far, 0.0)
    near, far = (np.clip(rho, max(abs(a - b), 1e-12), a + b) for rho in (near, far))
    elbow = Ball.between(*(np.arccos(np.clip((r * r - a * a - b * b) / (2.0 * a * b), -1.0, 1.0)) for r in (far, near)))
    towards = bearing(y, x)
    return Triangle(
        upper=towards - _end_angle(a, b, near, far) * bend,
        fore=towards + _end_angle(b, a, near, far) * bend,
        elbow=elbow,
        bend=bend,
        short=short,
    )


def _end_angle(own: float, other: float, near: Floats, far: Floats) -> Ball:
    """The triangle's angle between side ``own`` and ρ, for ρ between ``near`` and ``far``."""
    ends = [np.arccos(np.clip((r * r + own * own - other * other) / (2.0 * own * r), -1.0, 1.0)) for r in (near, far)]
    low, high = np.minimum(*ends), np.maximum(*ends)
    if own > other:
        widest = np.sqrt((own - other) * (own + other))
        high = np.where((near < widest) & (widest < far), np.arctan2(other, widest), high)
    return Ball.between(low, high)


@dataclass(frozen=True, eq=False, slots=True)
class TriangleSlopes:
    """dA and dB (K, N, m) [rad/m]; ``regular`` (N, m) is False where the elbow may be straight or folded."""

    upper: Ball
    fore: Ball
    regular: Bools

    def __getitem__(self, rows: Bools) -> TriangleSlopes:
        return TriangleSlopes(self.upper[:, rows], self.fore[:, rows], self.regular[rows])


def triangle_slopes(planar: Planar, values: Triangle, dx: Ball, dy: Ball | Floats) -> TriangleSlopes:
    """Enclose dA and dB, given dX and dY (K, N, m)."""
    least, most = sine_range(values.elbow)
    regular = least > FLAT
    inverse = reciprocal(np.where(regular, least, 1.0), np.where(regular, most, 1.0)) * values.bend
    cos_a, sin_a = cos_sin(values.upper)
    cos_b, sin_b = cos_sin(values.fore)
    to_upper, to_fore = inverse * (1.0 / planar.upper), inverse * (-1.0 / planar.fore)
    upper, fore = dx * (sin_b * to_upper), dx * (sin_a * to_fore)
    if isinstance(dy, Ball) or np.any(dy):
        upper, fore = upper + cos_b * to_upper * dy, fore + cos_a * to_fore * dy
    return TriangleSlopes(upper, fore, regular)


def triangle_bending(
    planar: Planar, values: Triangle, upper: Floats, fore: Floats, dx: Floats, dy: Floats
) -> tuple[Floats, Floats]:
    """Largest |d²A| and |d²B| (N, m), given the largest |dA|, |dB|, |d²X| and |d²Y|."""
    least = np.maximum(sine_range(values.elbow)[0], FLAT)
    straight = np.maximum(np.abs(np.cos(values.elbow.low)), np.abs(np.cos(values.elbow.high)))
    cos_a, sin_a = cos_sin(values.upper)
    cos_b, sin_b = cos_sin(values.fore)
    a_2, b_2 = planar.upper * upper**2, planar.fore * fore**2
    upper_2 = (sin_b.size * dx + cos_b.size * dy + straight * a_2 + b_2) / (planar.upper * least)
    fore_2 = (sin_a.size * dx + cos_a.size * dy + a_2 + straight * b_2) / (planar.fore * least)
    return upper_2, fore_2


def sine_range(angle: Ball) -> tuple[Floats, Floats]:
    """Smallest and largest sine of an angle in [0, π]."""
    low, high = angle.low, angle.high
    ends = np.sin(low), np.sin(high)
    upright = (low < 0.5 * np.pi) & (high > 0.5 * np.pi)
    return np.minimum(*ends), np.where(upright, 1.0, np.maximum(*ends))
