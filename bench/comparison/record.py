"""What one method did on one task, and how good that was."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

QUALITY = 1e-3
"""Relative distance to the reference that counts as solved."""


@dataclass(slots=True)
class Part:
    """One search: of one arm, or of all arms together.

    Attributes:
        arms: indices of the arms searched.
        trace: (CPU seconds since the part began, best E of these arms), falling.
        evaluations: placements looked at. seconds: CPU seconds until the part ended.
    """

    arms: list[int]
    trace: list[tuple[float, float]]
    evaluations: int
    seconds: float

    @property
    def best(self) -> float:
        """Best E; infinite if nothing feasible was found."""
        return self.trace[-1][1] if self.trace else inf

    def seconds_to(self, value: float) -> float:
        """When the part was first at ``value`` or below; infinite if never."""
        return next((time for time, best in self.trace if best <= value), inf)


@dataclass(slots=True)
class Record:
    """One method on one task.

    Attributes:
        task: name. method: name. form: "full" or "reduced": what the method was given.
        parts: its searches, one after the other.
        note: remark.
    """

    task: str
    method: str
    form: str
    parts: list[Part] = field(default_factory=list)
    note: str = ""

    @property
    def objective(self) -> float:
        """E of the cell."""
        return sum(part.best for part in self.parts)

    @property
    def evaluations(self) -> int:
        """Of all parts."""
        return sum(part.evaluations for part in self.parts)

    @property
    def seconds(self) -> float:
        """Of all parts."""
        return sum(part.seconds for part in self.parts)

    def solved_after(self, reference: list[float]) -> float:
        """Seconds until every part is within `QUALITY` of its arms' ``reference``; infinite if one never is."""
        return sum(part.seconds_to((1.0 + QUALITY) * sum(reference[i] for i in part.arms)) for part in self.parts)

    def combined_trace(self) -> list[tuple[float, float]]:
        """(seconds, E of the cell) as the parts run one after the other; begins when every arm has a placement."""
        offset, fixed, points = 0.0, 0.0, []
        for index, part in enumerate(self.parts):
            if index == len(self.parts) - 1:
                points = [(offset + time, fixed + best) for time, best in part.trace if fixed + best < inf]
            offset, fixed = offset + part.seconds, fixed + part.best
        return points
