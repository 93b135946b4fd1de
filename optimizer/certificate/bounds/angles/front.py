r"""Joint 1 over a box of base positions, and where the wrist point then lies in the plane of the arm.

With the base at p, the wrist point is at ``v = W - p`` from axis 1; D is its distance from the axis, α its azimuth
about h1 measured from a (the level part of n, normalised), o its prescribed component along the turned a, and
s = ±1 the shoulder:

    q1 = α + s acos(o / D),     f = s sqrt(D² - o²)          (coordinate in front of axis 1)

The height of W in that plane is linear in z, and so is o if n leans (``n·h1 ≠ 0``); else o is the same everywhere.
How values, slopes and second differentials are enclosed is derived in docs/method.md, section 7.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.optimizer.certificate.bounds.angles.targets import Targets
from duocell.optimizer.certificate.bounds.ball import Ball, bearing, cos_sin, distances, reciprocal
from duocell.optimizer.certificate.bounds.boxes import Boxes

SHORTEST = 1e-6
"""m in front of axis 1; with less the shoulder counts as singular: acos (o / D) is off by 1e-16 D / f."""


@dataclass(frozen=True, eq=False, slots=True)
class Front:
    """Values over each box (N) and pose (m).

    Attributes:
        first: (N, m) rad, q1 at yaw 0. front: (N, m) m, f. height: (N, m) m.
        offset: (N, m) or (1, m) m, o.
        short: (N, m) m, how much nearer to axis 1 than possible W is from everywhere in the box.
    """

    first: Ball
    front: Ball
    height: Ball
    offset: Ball
    short: Floats

    def __getitem__(self, rows: Bools) -> Front:
        return Front(self.first[rows], self.front[rows], self.height[rows], self.offset[rows], self.short[rows])


def front_values(targets: Targets, boxes: Boxes) -> Front:
    """Enclose joint 1 and the place of W over each box."""
    form, shoulder = targets.form, boxes.sign(0)
    seen = targets.wrist - boxes.centre[:, None, :]  # (N, m, 3)
    x, y = (Ball(seen[..., k], boxes.half[:, k, None]) for k in (0, 1))
    along = Ball(targets.sigma * seen[..., 2], boxes.half[:, 2, None])
    offset = Ball(np.full_like(along.centre, form.offset), np.zeros_like(along.centre)) - along * targets.lean
    offset = offset * (1.0 / targets.level)
    near, far = distances(x, y)
    ends = _ratio(offset.low, near), _ratio(offset.low, far), _ratio(offset.high, near), _ratio(offset.high, far)
    narrow = np.arccos(np.maximum(ends[2], ends[3]))  # as exact as the distances are, which the allowance covers
    wide = np.arccos(np.minimum(ends[0], ends[1]))
    start = np.arctan2(targets.across[1], targets.across[0])
    azimuth = (bearing(x, y) - start) * float(targets.sigma)
    least = np.maximum(np.maximum(offset.low, -offset.high), 0.0)  # smallest |o|
    front = Ball.between(_leg(near, offset.size), _leg(far, least))
    height = along * targets.level - offset * targets.lean
    return Front(
        first=azimuth + Ball.between(narrow, wide) * shoulder,
        front=front * shoulder,
        height=height,
        offset=offset,
        short=np.maximum(least - far, 0.0),
    )


def _ratio(offset: Floats, distance: Floats) -> Floats:
    ratio: Floats = np.clip(offset / np.maximum(distance, 1e-300), -1.0, 1.0)
    return ratio


def _leg(hypotenuse: Floats, leg: Floats) -> Floats:
    """The other leg of a right triangle; 0 where there is none."""
    other: Floats = np.sqrt(np.maximum(hypotenuse**2 - leg**2, 0.0))
    return other


@dataclass(frozen=True, eq=False, slots=True)
class FrontSlopes:
    """Derivatives with respect to the base position, first axis x, y[, z].

    Attributes:
        first: (K, N, m) rad/m. front: (K, N, m). height: (K, 1, 1).
        regular: (N, m) True where the shoulder is nowhere singular in the box; elsewhere the slopes mean nothing.
    """

    first: Ball
    front: Ball
    height: Floats
    regular: Bools

    def __getitem__(self, rows: Bools) -> FrontSlopes:
        return FrontSlopes(self.first[:, rows], self.front[:, rows], self.height, self.regular[rows])


def front_slopes(targets: Targets, values: Front) -> FrontSlopes:
    """Enclose the derivatives of q1, f and the height."""
    sigma, dims = float(targets.sigma), targets.dims
    low, high = values.front.low, values.front.high
    regular = (low > SHORTEST) | (high < -SHORTEST)
    inverse = reciprocal(np.where(regular, low, 1.0), np.where(regular, high, 1.0))
    start = np.arctan2(targets.across[1], targets.across[0])
    cos, sin = cos_sin(values.first * sigma + start)
    shape = (dims, *low.shape)
    across = Ball(np.zeros(shape), np.zeros(shape))  # a'·dp + do
    ahead = Ball(np.zeros(shape), np.zeros(shape))  # g'·dp
    for part, k, ball in ((across, 0, cos), (across, 1, sin), (ahead, 0, sin * sigma), (ahead, 1, cos * -sigma)):
        part.centre[k], part.radius[k] = ball.centre, ball.radius
    height = np.zeros((dims, 1, 1))
    if dims == 3:
        leaning = targets.lean * sigma / targets.level  # do/dz
        across.centre[2] = leaning
        height[2] = -sigma * targets.level - leaning * targets.lean
    first = -(across * inverse)
    return FrontSlopes(first, first * values.offset - ahead, height, regular)


def front_bending(targets: Targets, values: Front, first: Floats, front: Floats, half: Floats) -> tuple[Floats, Floats]:
    """Largest |d²q1| and |d²f| (N, m), given the largest |dq1| and |df|, for steps of at most ``half`` (N, K) m."""
    offset, farthest = values.offset.size, values.front.size
    nearest = np.maximum(np.abs(values.front.centre) - values.front.radius, SHORTEST)
    lean = abs(targets.lean) / targets.level * half[:, 2, None] if targets.dims == 3 else 0.0
    first_2 = first * (offset * first + 2.0 * front) / nearest
    return first_2, farthest * first**2 + offset * first_2 + 2.0 * lean * first
