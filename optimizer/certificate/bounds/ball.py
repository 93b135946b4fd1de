"""Intervals as centre and radius, for arrays, with the few functions the bounds need.

A `Ball` stands for every array whose entries lie within ``radius`` of ``centre``. All operations are inclusions:
the result of an operation on members is a member of the result (docs/method.md, section 7.1). Rounding is not directed;
whoever draws a conclusion from a ball leaves a slack many orders above it
(`duocell.optimizer.certificate.bounds.angles.joints.SLACK`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from duocell.models.base.arrays import Bools, Floats

ANYTHING = 1e3
"""rad; radius of an angle nothing is known about. Finite, so that no operation ends in inf - inf."""


@dataclass(frozen=True, eq=False, slots=True)
class Ball:
    """All arrays within ``radius`` (>= 0) of ``centre``; the shapes broadcast."""

    centre: Floats
    radius: Floats

    @staticmethod
    def between(low: Floats, high: Floats) -> Ball:
        """The ball of an interval."""
        return Ball(0.5 * (low + high), 0.5 * (high - low))

    @property
    def low(self) -> Floats:
        """Smallest member."""
        return self.centre - self.radius

    @property
    def high(self) -> Floats:
        """Largest member."""
        return self.centre + self.radius

    @property
    def size(self) -> Floats:
        """Largest absolute value of a member."""
        return np.abs(self.centre) + self.radius

    def __add__(self, other: Ball | Floats | float) -> Ball:
        if isinstance(other, Ball):
            return Ball(self.centre + other.centre, self.radius + other.radius)
        return Ball(self.centre + other, self.radius)

    def __sub__(self, other: Ball | Floats | float) -> Ball:
        if isinstance(other, Ball):
            return Ball(self.centre - other.centre, self.radius + other.radius)
        return Ball(self.centre - other, self.radius)

    def __neg__(self) -> Ball:
        return Ball(-self.centre, self.radius)

    def __mul__(self, other: Ball | Floats | float) -> Ball:
        if isinstance(other, Ball):
            radius = np.abs(self.centre) * other.radius + self.radius * other.size
            return Ball(self.centre * other.centre, radius)
        return Ball(self.centre * other, self.radius * np.abs(other))

    def __getitem__(self, index: Any) -> Ball:
        return Ball(self.centre[index], self.radius[index])

    def meet(self, other: Ball) -> Ball:
        """What both contain; where rounding leaves nothing, a point between them."""
        low, high = np.maximum(self.low, other.low), np.minimum(self.high, other.high)
        return Ball(0.5 * (low + high), np.maximum(0.5 * (high - low), 0.0))


def stacked(balls: list[Ball]) -> Ball:
    """Balls of equal shape along a new first axis."""
    shape = np.broadcast_shapes(*(b.centre.shape for b in balls), *(b.radius.shape for b in balls))
    centres, radii = np.empty((len(balls), *shape)), np.empty((len(balls), *shape))
    for k, ball in enumerate(balls):
        centres[k], radii[k] = ball.centre, ball.radius
    return Ball(centres, radii)


def cos_sin(angle: Ball) -> tuple[Ball, Ball]:
    """Cosine and sine of an angle [rad].

    ``cos(c + t) = cos c cos t - sin c sin t`` with ``|t| <= r``, and likewise the sine: cos t lies in [cos r, 1] and
    |sin t| below sin r (below 1 beyond a quarter turn).
    """
    cos, sin = np.cos(angle.centre), np.sin(angle.centre)
    reach = np.minimum(angle.radius, np.pi)
    middle = 0.5 * (1.0 + np.cos(reach))
    spread, swing = 1.0 - middle, np.sin(np.minimum(reach, 0.5 * np.pi))
    return (
        Ball(cos * middle, np.abs(cos) * spread + np.abs(sin) * swing),
        Ball(sin * middle, np.abs(sin) * spread + np.abs(cos) * swing),
    )


def reciprocal(low: Floats, high: Floats) -> Ball:
    """1/t for t between ``low`` and ``high``, both of the same sign."""
    one, other = 1.0 / high, 1.0 / low
    return Ball(0.5 * (one + other), 0.5 * np.abs(other - one))


def bearing(x: Ball, y: Ball) -> Ball:
    """``atan2(y, x)`` of a rectangle: the corners decide, unless the rectangle holds the origin (any angle)."""
    dx, dy = x.radius, y.radius
    # Corner (i, j) is the centre plus (i dx, j dy): cross and dot product with the centre, split into their terms.
    across_x, across_y = x.centre * dy, y.centre * dx
    along_x, along_y = x.centre * dx, y.centre * dy
    square = x.centre**2 + y.centre**2
    low, high = None, None
    for i, j in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        turn = np.arctan2(j * across_x - i * across_y, square + i * along_x + j * along_y)
        low = turn if low is None else np.minimum(low, turn)
        high = turn if high is None else np.maximum(high, turn)
    assert low is not None
    assert high is not None
    centre = np.arctan2(y.centre, x.centre) + 0.5 * (low + high)
    return Ball(centre, np.where(holds_origin(x, y), ANYTHING, 0.5 * (high - low)))


def holds_origin(x: Ball, y: Ball) -> Bools:
    """True where the rectangle contains (0, 0) (or touches it within rounding)."""
    inside: Bools = (np.abs(x.centre) <= x.radius + 1e-12) & (np.abs(y.centre) <= y.radius + 1e-12)
    return inside


def distances(x: Ball, y: Ball) -> tuple[Floats, Floats]:
    """Smallest and largest distance of a rectangle from the origin."""
    near = np.hypot(np.maximum(np.abs(x.centre) - x.radius, 0.0), np.maximum(np.abs(y.centre) - y.radius, 0.0))
    return near, np.hypot(x.size, y.size)
