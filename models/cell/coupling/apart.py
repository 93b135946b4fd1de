"""Two bases in two places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import ClassVar

from duocell.models.cell.coupling.coupling import Base, Coupling, Rows, check_arms
from duocell.models.cell.coupling.distance import TINY
from duocell.models.cell.coupling.relations import Relation, Separation


@dataclass(frozen=True, slots=True)
class Apart(Coupling):
    """The origins of two bases keep a distance in space. No request asks for it: it holds for every two arms.

    A search is told of it only where it would put two arms in one place (`duocell.models.cell.one_place`).

    Attributes:
        arms: two.
        least: m.
    """

    least: float
    kind: ClassVar[str] = "apart"

    def __post_init__(self) -> None:
        check_arms(self.arms, 2, 2)

    def rows(self, bases: Sequence[Base]) -> Rows:
        """The distance [m]."""
        first, second = (bases[arm] for arm in self.arms)
        squares = sum((second[axis] - first[axis]) ** 2 for axis in range(3))
        return Rows(((squares + TINY) ** 0.5,), (self.least,), (inf,), ("two bases in one place",))

    def relations(self) -> tuple[Relation, ...]:
        """The distance in space."""
        first, second = self.arms
        return (Separation((first, second), self.least, level=False),)
