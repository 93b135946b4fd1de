"""How near to each other and how far apart two bases may stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from duocell.models.base.errors import InvalidInput
from duocell.models.cell.coupling.coupling import Base, Rows, check_arms

TINY = 1e-12
"""m²; keeps the root smooth where two bases coincide."""


@dataclass(frozen=True, slots=True)
class Distance:
    """Horizontal distance of two base origins.

    Attributes:
        arms: two.
        minimum: m. maximum: m; infinite for none.
    """

    arms: tuple[int, ...]
    minimum: float = 0.0
    maximum: float = inf
    kind: str = "distance"

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
