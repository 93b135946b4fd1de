"""Two arms on one stand: the pose from base to base, given or in a box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, hypot
from typing import ClassVar, Self

from duocell.models.base.errors import InvalidInput
from duocell.models.cell.coupling.coupling import (
    Base,
    Coupling,
    Rows,
    Scalar,
    arctan2,
    check_arms,
    cosine,
    sine,
)
from duocell.models.cell.coupling.distance import TINY
from duocell.models.cell.coupling.relations import (
    Bearing,
    Common,
    Linear,
    Relation,
    Separation,
    X,
    Y,
    Yaws,
    Z,
    difference,
    wrapped,
)
from duocell.models.robot.arm import TURN, Arm, Interval

NONE = Interval(0.0, 0.0)
"""No shift, no turn."""
_Row = tuple[Scalar, float, float, str]
"""Value, lower, upper, label."""


@dataclass(frozen=True, slots=True)
class Rigid(Coupling):
    """The second base as seen from the first: in its frame, which its yaw has turned.

    Attributes:
        arms: two, with bases that stand upright.
        x: m. y: m, of the second base's origin in the frame of the first base. z: m, by which it is higher.
        yaw: rad, by which it is turned against the first, modulo 2π; 2π wide or wider means free.
    """

    x: Interval
    y: Interval
    z: Interval = NONE
    yaw: Interval = NONE
    kind: ClassVar[str] = "rigid"

    def __post_init__(self) -> None:
        check_arms(self.arms, 2, 2)
        for name in ("x", "y", "z", "yaw"):
            side: Interval = getattr(self, name)
            if not side.low <= side.high:
                raise InvalidInput(f"[{side.low:g}, {side.high:g}] holds nothing; give [low, high].", f"/{name}")

    def check(self, arms: Sequence[Arm]) -> None:
        """Refuse bases that are not upright: their yaw turns about another axis than the stand's."""
        for place, arm in enumerate(self.arms):
            if not arms[arm].upright:
                raise InvalidInput(
                    f"{arms[arm].name!r} has a mount, and coupling rigid ties upright bases; leave the mount out.",
                    f"/arms/{place}",
                )

    def rows(self, bases: Sequence[Base]) -> Rows:
        """Distance, place and height of the second base [m], and how it is turned [rad].

        A place that is given is a distance, which the positions alone decide, and a direction, which the yaw of the
        first base decides: searches keep one by moving bases and the other by turning them. Of a place in a box the
        distance says what follows from it for positions alone.
        """
        first, second = (bases[arm] for arm in self.arms)
        x, y = second[0] - first[0], second[1] - first[1]
        rows = [*self._place(x, y, first[3]), (second[2] - first[2], self.z.low, self.z.high, "height")]
        if not self._any_yaw:
            off = second[3] - first[3] - self.yaw.middle
            half = 0.5 * self.yaw.width
            rows.append((arctan2(sine(off), cosine(off)), -half, half, "yaw against the other base"))
        values, lower, upper, labels = zip(*rows, strict=True)
        return Rows(values, lower, upper, labels)

    def _place(self, x: Scalar, y: Scalar, yaw: Scalar) -> list[_Row]:
        """Rows of the second base's place, seen from above; x and y [m] from the first base in the world."""
        least, most = self._distances()
        if most == 0.0:
            return [(x, 0.0, 0.0, "place on the stand"), (y, 0.0, 0.0, "place on the stand")]
        distance = (x**2 + y**2 + TINY) ** 0.5, least, most, "distance of the bases"
        if self._place_given:
            heading = yaw + atan2(self.y.low, self.x.low)
            ahead, aside = cosine(heading) * x + sine(heading) * y, cosine(heading) * y - sine(heading) * x
            return [distance, (arctan2(aside, ahead + TINY), 0.0, 0.0, "direction of the second base")]
        along, across = cosine(yaw) * x + sine(yaw) * y, cosine(yaw) * y - sine(yaw) * x
        sides = (along, self.x, "x on the stand"), (across, self.y, "y on the stand")
        return [distance, *((value, side.low, side.high, label) for value, side, label in sides)]

    def relations(self) -> tuple[Relation, ...]:
        """Height, distances, the direction from either base, and the difference of the yaws."""
        first, second = self.arms
        least, most = self._distances()
        low, high = _nearest(self.z), _farthest(self.z)
        found: list[Relation] = [
            Linear(difference((first, second), Z), self.z.low, self.z.high),
            Separation((first, second), least, most),
            Separation((first, second), hypot(least, low), hypot(most, high), level=False),
        ]
        if most == 0.0:
            found += [Common(self.arms, X), Common(self.arms, Y)]
        if least > 0.0:
            found += self._bearings()
        if not self._any_yaw:
            words = "pair that keeps it", "turn its yaw by"
            found.append(Yaws((first, second), -1, self.yaw.low, self.yaw.high, words, "yaw"))
        return tuple(found)

    def _bearings(self) -> list[Relation]:
        """Directions from the first base to the second: a rectangle that leaves out the origin spans less than π."""
        first, second = self.arms
        middle = atan2(self.y.middle, self.x.middle)
        corners = [atan2(y, x) for x in (self.x.low, self.x.high) for y in (self.y.low, self.y.high)]
        low, high = (middle + end(wrapped(angle - middle) for angle in corners) for end in (min, max))
        found: list[Relation] = [Bearing((first, second), low, high, axis=first)]
        if not self._any_yaw:
            found.append(Bearing((first, second), low - self.yaw.high, high - self.yaw.low, axis=second))
        return found

    def loosened(self, amount: float) -> Self:
        """With a wider box."""
        x, y, z = (Interval(side.low - amount, side.high + amount) for side in (self.x, self.y, self.z))
        return replace(self, x=x, y=y, z=z)

    @property
    def _any_yaw(self) -> bool:
        return self.yaw.width >= TURN - 1e-9

    @property
    def _place_given(self) -> bool:
        return self.x.fixed and self.y.fixed

    def _distances(self) -> tuple[float, float]:
        """m, how near and how far the second base may be, seen from above."""
        return hypot(_nearest(self.x), _nearest(self.y)), hypot(_farthest(self.x), _farthest(self.y))


def _nearest(side: Interval) -> float:
    """Distance of an interval from 0."""
    return max(side.low, -side.high, 0.0)


def _farthest(side: Interval) -> float:
    """Distance from 0 of what is farthest in an interval."""
    return max(abs(side.low), abs(side.high))
