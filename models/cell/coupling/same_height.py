"""Bases at one height."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

from duocell.models.cell.coupling.coupling import Base, Coupling, Rows, check_arms
from duocell.models.cell.coupling.relations import Common, Relation, Z


@dataclass(frozen=True, slots=True)
class SameHeight(Coupling):
    """All base origins have the same z.

    Attributes:
        arms: two or more.
    """

    kind: ClassVar[str] = "same_z"

    def __post_init__(self) -> None:
        check_arms(self.arms, 2, None)

    def rows(self, bases: Sequence[Base]) -> Rows:
        """Differences of neighbours [m]."""
        pairs = list(pairwise(self.arms))
        zeros = (0.0,) * len(pairs)
        values = tuple(bases[j][2] - bases[i][2] for i, j in pairs)
        return Rows(values, zeros, zeros, tuple("same height" for _ in pairs))

    def relations(self) -> tuple[Relation, ...]:
        """One height."""
        return (Common(self.arms, Z),)
