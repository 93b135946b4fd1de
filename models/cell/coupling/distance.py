"""How near to each other and how far apart two bases may stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import ClassVar, Self

from duocell.models.base.errors import InvalidInput
from duocell.models.cell.coupling.coupling import Base, Coupling, Rows, check_arms
from duocell.models.cell.coupling.relations import Relation, Separation

TINY = 1e-12
"""m²; keeps the root smooth where two bases coincide."""


@dataclass(frozen=True, slots=True)
class Distance(Coupling):
    """Horizontal distance of two base origins.

    Attributes:
        arms: two.
        minimum: m. maximum: m; infinite for none.
    """

    minimum: float = 0.0
    maximum: float = inf
    kind: ClassVar[str] = "distance"

    def __post_init__(self) -> None:
        check_arms(self.arms, 2, 2)
        if not 0.0 <= self.minimum <= self.maximum:
            raise InvalidInput(
                f"the distance must lie between {self.minimum:g} m and {self.maximum:g} m, which no distance does; "
                "give 0 <= minimum <= maximum.",
                "/minimum",
            )

    def rows(self, bases: Sequence[Base]) -> Rows:
        """The distance [m]."""
        first, second = (bases[arm] for arm in self.arms)
        value = ((second[0] - first[0]) ** 2 + (second[1] - first[1]) ** 2 + TINY) ** 0.5
        return Rows((value,), (self.minimum,), (self.maximum,), ("distance of the bases",))

    def relations(self) -> tuple[Relation, ...]:
        """The distance."""
        first, second = self.arms
        fields = "minimum", "maximum"
        return (Separation((first, second), self.minimum, self.maximum, fields=fields),)

    def loosened(self, amount: float) -> Self:
        """With wider limits."""
        return replace(self, minimum=max(self.minimum - amount, 0.0), maximum=self.maximum + amount)
