"""Two bases that are mirror images of each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import ClassVar

from duocell.models.cell.coupling.coupling import Base, Coupling, Rows, check_arms, sine
from duocell.models.cell.coupling.relations import Common, Linear, Relation, Yaws, Z, across, along


@dataclass(frozen=True, slots=True)
class Mirror(Coupling):
    """Mirrored about a vertical plane: positions, heights, and the x axes of the bases (z stays up, y follows).

    Attributes:
        arms: two.
        point: (x, y) m, on the plane.
        angle: rad, direction of the plane seen from above, from the world's x axis.
    """

    point: tuple[float, float]
    angle: float
    kind: ClassVar[str] = "mirror"

    def __post_init__(self) -> None:
        check_arms(self.arms, 2, 2)

    def rows(self, bases: Sequence[Base]) -> Rows:
        """How far the second base is from the mirror image of the first: two of position and height [m], yaw [rad].

        The yaw's row is ``2 sin(error / 2)``: it vanishes where the yaws fit modulo 2π, and nowhere else.
        """
        first, second = (bases[arm] for arm in self.arms)
        along, across = (cos(self.angle), sin(self.angle)), (-sin(self.angle), cos(self.angle))
        shift = (second[0] - first[0]) * along[0] + (second[1] - first[1]) * along[1]
        middle = (first[0] + second[0]) / 2.0 - self.point[0], (first[1] + second[1]) / 2.0 - self.point[1]
        off = 2.0 * (middle[0] * across[0] + middle[1] * across[1])
        turn = 2.0 * sine((first[3] + second[3]) / 2.0 - self.angle)
        zeros = (0.0,) * 4
        labels = ("mirrored along the plane", "mirrored across the plane", "same height", "mirrored yaw")
        return Rows((shift, off, second[2] - first[2], turn), zeros, zeros, labels)

    def relations(self) -> tuple[Relation, ...]:
        """One height, one coordinate along the plane, places as far from it on both sides, and the sum of the yaws."""
        first, second = self.arms
        aside = across(self.angle)
        middle = 2.0 * (aside[0] * self.point[0] + aside[1] * self.point[1])
        total = 2.0 * self.angle
        return (
            Common(self.arms, Z),
            Common(self.arms, along(self.angle)),
            Linear(((first, aside), (second, aside)), middle, middle),
            Yaws((first, second), 1, total, total, ("mirrored pair", "turn the mirror by"), "angle", 0.5),
        )
