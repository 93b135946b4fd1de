"""What the measures say of a path."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Measured:
    """A measure along the path of one arm.

    Attributes:
        measure: its name. unit: of the following.
        minimum, mean, maximum: over the poses, whatever these count for.
    """

    measure: str
    unit: str
    minimum: float
    mean: float
    maximum: float


@dataclass(frozen=True, slots=True)
class TermShare:
    """What one measure contributes to the objective.

    Attributes:
        measure: its name. weight: what its cost is multiplied by.
        unit: of the cost. cost: summed up over the poses, by what these count for.
    """

    measure: str
    weight: float
    unit: str
    cost: float
