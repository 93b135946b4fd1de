"""How far two arms that are nearly one may be apart at the same joint values: a bound for all joint values at once.

The flange of a chain is the product of one turn per joint and of one home pose. Of two chains the products differ turn
by turn: what stands before a joint (as drawn) only moves the difference about, what stands behind it (truly) is the
lever. Let x be the place of a point of the hand before the turn about axis i, at most r from a point p of the true
axis; the drawn axis, through p', is tilted by δ against the true one and passes p at a distance d. The turns R and R'
about them by the same angle differ by a turn of at most 2 δ, and

    (R (x - p) + p) - (R' (x - p') + p') = (R - R') (x - p) + (1 - R') (p - p')

is no longer than 2 δ r + 2 d. The sum over the joints bounds how far the point of the hand is off, the sum of 2 δ how
far the hand is turned (docs/method.md, section 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.base.pose import rotation_angle
from duocell.models.kinematics.chain import Chain

ROUNDED = 1.0 + 1e-9
"""What bounds are multiplied by."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Bounds of how far an arm is from another one at the same joint values.

    Attributes:
        position: m, of the flange. wrist: m, of the point of the hand in which the other's last axes meet.
        angle: rad, of the hand.
        fifth: rad, of the values of joint 5 at which the wrist is singular.
        offsets: m, 2 Σ d_i.
        length: of the lengths by which Jacobians are divided, relative.
    """

    position: float = 0.0
    wrist: float = 0.0
    angle: float = 0.0
    fifth: float = 0.0
    offsets: float = 0.0
    length: float = 0.0

    @property
    def negligible(self) -> bool:
        """True if no check can tell the two apart, so that proofs need room for no more than that."""
        return max(self.position, self.angle) <= KEPT


SAME = Difference()
"""Of an arm from itself."""


def offsets_of(true: Chain, drawn: Chain) -> float:
    """2 Σ d_i [m], d_i the distance of a point of the true axis i from the drawn one."""
    away = np.cross(drawn.points - true.points, drawn.axes)
    return 2.0 * float(np.sum(np.linalg.norm(away, axis=1))) * ROUNDED


def moved_apart(true: Chain, drawn: Chain, point: Floats) -> tuple[float, float]:
    """Bounds [m] and [rad] of how far two chains take a hand apart.

    Args:
        true: a chain. drawn: another one with the same place of the flange at zero.
        point: (3,) m, point of the hand in the flange frame.
    """
    ends = [*true.points[1:], true.home[:3, :3] @ point + true.home[:3, 3]]
    links = [float(np.linalg.norm(end - start)) for start, end in zip(true.points, ends, strict=True)]
    position, angle = 0.0, 0.0
    for i in range(len(true.axes)):
        tilt = float(np.arcsin(np.clip(np.linalg.norm(np.cross(true.axes[i], drawn.axes[i])), 0.0, 1.0)))
        offset = float(np.linalg.norm(np.cross(drawn.points[i] - true.points[i], drawn.axes[i])))
        position += 2.0 * tilt * sum(links[i:]) + 2.0 * offset
        angle += 2.0 * tilt
    turned = float(rotation_angle(true.home[:3, :3].T @ drawn.home[:3, :3]))
    position += turned * float(np.linalg.norm(point))
    return position * ROUNDED, (angle + turned) * ROUNDED
