"""In which direction one base lies as seen from the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, inf, sin
from typing import ClassVar

from duocell.models.cell.coupling.coupling import Base, Coupling, Rows, check_arms
from duocell.models.cell.coupling.relations import Bearing, Common, Linear, Relation, across, along, difference

APART = 0.01
"""m; two bases that are nearer to each other lie in no direction: without it two contradictory directions are kept in
one spot."""


@dataclass(frozen=True, slots=True)
class Direction(Coupling):
    """The second base lies from the first in a fixed horizontal direction, at least `APART` away.

    Attributes:
        arms: two.
        angle: rad, from the world's x axis.
    """

    angle: float
    kind: ClassVar[str] = "direction"

    def __post_init__(self) -> None:
        check_arms(self.arms, 2, 2)

    def rows(self, bases: Sequence[Base]) -> Rows:
        """How far the second base is off the line [m], and how far along it [m]."""
        first, second = (bases[arm] for arm in self.arms)
        x, y = second[0] - first[0], second[1] - first[1]
        aside, along = -sin(self.angle) * x + cos(self.angle) * y, cos(self.angle) * x + sin(self.angle) * y
        return Rows(
            (aside, along), (0.0, APART), (0.0, inf), ("direction of the second base", "side of the second base")
        )

    def relations(self) -> tuple[Relation, ...]:
        """On the line, on its side of the first base."""
        first, second = self.arms
        side = Linear(difference((first, second), along(self.angle)), APART, inf)
        return Common(self.arms, across(self.angle)), side, Bearing((first, second), self.angle, self.angle)
