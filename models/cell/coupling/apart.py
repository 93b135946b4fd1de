"""Two bases in two places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from duocell.models.cell.coupling.coupling import Base, Rows, check_arms
from duocell.models.cell.coupling.distance import TINY


@dataclass(frozen=True, slots=True)
class Apart:
    """The origins of two bases keep a distance in space. No request asks for it: it holds for every two arms.

    A search is told of it only where it would put two arms in one place (`duocell.models.cell.one_place`).

    Attributes:
        arms: two.
        least: m.
    """

    arms: tuple[int, ...]
    least: float
    kind: str = "apart"

    def __post_init__(self) -> None:
        check_arms(self.arms, 2, 2)

    def rows(self, bases: Sequence[Base]) -> Rows:
        """The distance [m]."""
        first, second = (bases[arm] for arm in self.arms)
        squares = sum((second[axis] - first[axis]) ** 2 for axis in range(3))
        return Rows(((squares + TINY) ** 0.5,), (self.least,), (inf,), ("two bases in one place",))
