"""What a search of a coupled cell found, and what it takes over of what it meets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from duocell.optimizer.clearance.clearance import PathClearance
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.progress.incumbents import layout_found
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.sqp.nearby import nearby
from duocell.optimizer.sqp.refine import Refined

Told = Callable[[Sequence[ArmSolution], float, PathClearance | None], None]
"""Called with a clean layout, its E and the check of its way."""
SAME_PLACE, SAME_COST = 0.02, 1e-3
"""m and relative: layouts nearer than this are the same."""


@dataclass(eq=False, slots=True)
class CoupledSearch:
    """What was found for a coupled cell.

    Attributes:
        found: distinct clean layouts, best first. nearest: the least violating one that was found, if none is clean.
        candidates: bases × postures looked at. starts: refinements. hits: how often the best layout was reached.
        finished: False if time ran out.
        reasons, proved: why there is none, and whether that is certain.
        told: called with every clean layout, its E and the check of its way.
    """

    found: list[Refined] = field(default_factory=list)
    nearest: Refined | None = None
    candidates: int = 0
    starts: int = 0
    hits: int = 0
    finished: bool = True
    reasons: tuple[Reason, ...] = ()
    proved: bool = False
    told: Told = layout_found

    @property
    def best(self) -> Refined | None:
        """The answer."""
        return self.found[0] if self.found else None

    def keep(self, refined: Refined) -> bool:
        """Take a layout over; True if it is clean."""
        if not refined.clean:
            if self.nearest is None or refined.violation < self.nearest.violation:
                self.nearest = refined
            return False
        self.told(refined.points, refined.objective, refined.clearance)
        for number, other in enumerate(self.found):
            if _same(refined, other):
                self.hits += number == 0
                if refined.objective < other.objective:
                    self.found[number] = refined
                    self.found.sort(key=lambda one: one.objective)
                return True
        self.found.append(refined)
        self.found.sort(key=lambda one: one.objective)
        if self.found[0] is refined:
            self.hits = 1
        return True

    def improve(self, known: Refined, refined: Refined) -> None:
        """Put a clean layout in the place of one that led to it."""
        self.told(refined.points, refined.objective, refined.clearance)
        self.found[self.found.index(known)] = refined
        self.found.sort(key=lambda one: one.objective)


def _same(one: Refined, other: Refined) -> bool:
    if abs(one.objective - other.objective) > SAME_COST * max(one.objective, 1e-9):
        return False
    return nearby(one.points, other.points, SAME_PLACE)
