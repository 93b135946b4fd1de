"""An irreducible set of requirements that together leave no layout, grown from the layouts that smaller sets leave."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from duocell.models.cell.cell import Cell
from duocell.optimizer.infeasibility.requirements import (
    OWN,
    Kind,
    Requirement,
    Selection,
    arms_of,
    by_interest,
    everything,
    restricted,
)
from duocell.optimizer.infeasibility.searched.partial_path import PartialPath, extended
from duocell.optimizer.infeasibility.searched.trial import find
from duocell.optimizer.infeasibility.searched.violations import Violation, part_violations, violations
from duocell.optimizer.nlp.program import ArmSolution

SHARE = 0.3
"""Share of the time left that one trial may take."""
HINTS = 3
"""Known layouts tried before a search."""


@dataclass(frozen=True, eq=False, slots=True)
class Known:
    """A layout met on the way.

    Attributes:
        paths: index of an arm -> where it stands and how it goes; arms that are not there are not placed.
        breaks: all that it breaks.
    """

    paths: dict[int, PartialPath]
    breaks: tuple[Violation, ...]

    def keeps(self, selection: Selection) -> bool:
        """True if it breaks nothing of a selection."""
        return not any(violation.within(selection) for violation in self.breaks)

    def without(self, selection: Selection) -> Known:
        """The same, not keeping a selection: it seemed to, but its path did not pass the full check."""
        refused = Violation(selection.requirements, selection.first, selection.last)
        return replace(self, breaks=(*self.breaks, refused))


@dataclass(frozen=True, eq=False, slots=True)
class Conflict:
    """What blocks a cell.

    Attributes:
        selection: no layout was found that keeps all of it.
        irreducible: True if one was found for each of its members that keeps all the others, and time cut no search.
        known: layouts met on the way. If one of them keeps everything, nothing blocks.
    """

    selection: Selection
    irreducible: bool
    known: tuple[Known, ...]


class ConflictSearch:
    """Finds a conflict of one cell until a deadline (`time.perf_counter` value)."""

    def __init__(self, cell: Cell, deadline: float, seed: int, suspects: Collection[str] = ()) -> None:
        """``suspects`` are names of arms that are likely to blame."""
        self.cell, self.deadline, self.seed, self.suspects = cell, deadline, seed, suspects
        self.whole = everything(cell)
        self.part = part_violations(cell)
        self.known: list[Known] = []
        self.solved = False
        self.cut_short = False

    def late(self) -> bool:
        """True if the time is over, or there is nothing to be explained."""
        return self.solved or time.perf_counter() > self.deadline

    def meet(self, paths: dict[int, PartialPath], kept: Selection | None = None) -> None:
        """Take a layout over; ``kept`` is what it was found to keep, whatever rounding says."""
        breaks = (*violations(self.cell, paths), *self.part)
        self.known.append(Known(paths, tuple(v for v in breaks if kept is None or not v.within(kept))))
        self.solved |= kept == self.whole

    def run(self) -> Conflict:
        """What blocks among the things around the arms, then what of the arms' own, then which poses.

        Whenever a layout turns up that keeps all of what was taken to block, it is begun again: now it is known.
        """
        selection = self._smallest(self.whole, self._around())
        while not self.late():
            selection = self._grown(self.whole, self._around())
            selection = self._grown(selection, [e for e in by_interest(selection.requirements) if e.kind in OWN])
            selection = self._reduced(self._shortened(selection))
            if self._blocked(selection):
                break
        return Conflict(selection, not (self.late() or self.cut_short), tuple(self.known))

    def _around(self) -> list[Requirement]:
        """What is not the arms' own, and the arms: the first to be left out first."""
        around = [requirement for requirement in by_interest(self.whole.requirements) if requirement.kind not in OWN]
        around.sort(key=lambda e: e.kind is Kind.ARM and self.cell.arms[e.index].name in self.suspects)
        if self.part:  # certain, whatever the arms do
            around.sort(key=lambda requirement: requirement.kind is not Kind.ARM)
        return around

    def _blocked(self, selection: Selection) -> bool:
        """True if no known layout keeps all of a selection."""
        return not any(known.keeps(selection) for known in self.known)

    def _grown(self, selection: Selection, removable: Sequence[Requirement]) -> Selection:
        """The set with only those of its removable requirements that it takes to block, as far as time allows."""
        smaller = self._smallest(selection, removable)
        while not self.late() and self._possible(smaller) and self._blocked(selection):
            smaller = self._smallest(selection, removable)
        return smaller

    def _smallest(self, selection: Selection, removable: Sequence[Requirement]) -> Selection:
        """Without the requirements that it does not take for every known layout to break something."""
        active = [[v for v in known.breaks if v.within(selection)] for known in self.known]
        for requirement in removable:
            fewer = [[v for v in breaks if requirement not in v.requirements] for breaks in active]
            if all(fewer):
                active, selection = fewer, selection.without(requirement)
        return selection

    def _shortened(self, selection: Selection) -> Selection:
        """The set with no more poses than it takes to block, as far as time allows.

        Between the fewest poses that known layouts leave and those that are known to block, bisect.
        """
        fewest = tried = self._fewest(selection)
        while fewest != selection and not self.late() and self._blocked(selection):
            if self._possible(tried):
                fewest = self._fewest(selection)
                tried = selection.halfway(fewest)
            elif not self.late():
                selection = tried
                fewest = tried = self._fewest(selection)
        return selection

    def _fewest(self, selection: Selection) -> Selection:
        """With no pose at either end that it does not take for every known layout to break something."""
        while True:
            for shorter in selection.shorter():
                if self._blocked(shorter):
                    selection = shorter
                    break
            else:
                return selection

    def _reduced(self, selection: Selection) -> Selection:
        """Without members that turn out not to be needed, as far as time allows."""
        for requirement in by_interest(selection.requirements):
            if not self.late() and not self._possible(selection.without(requirement)) and not self.late():
                selection = selection.without(requirement)
        untried = list(selection.shorter())
        while untried and not self.late():
            shorter = untried.pop()
            if not self._possible(shorter) and not self.late():
                selection, untried = shorter, list(shorter.shorter())
        return selection

    def _possible(self, selection: Selection) -> bool:
        """Look for a layout that keeps a selection, at first among those that are known."""
        cell = restricted(self.cell, selection)
        hints = [points for known in self.known if (points := self._hint(known, selection)) is not None]
        now = time.perf_counter()
        trial = find(cell, now + SHARE * (self.deadline - now), hints[-HINTS:], self.seed)
        self.cut_short |= trial.cut_short
        found = trial.found
        if found is None:
            self.known = [known.without(selection) if known.keeps(selection) else known for known in self.known]
            return False
        paths = {
            a: extended(self.cell, self.cell.arms[a], point, selection.first, selection.last)
            for a, point in zip(arms_of(self.cell, selection), found.points, strict=True)
        }
        self.meet(paths, selection)
        return True

    def _hint(self, known: Known, selection: Selection) -> tuple[ArmSolution, ...] | None:
        """A known layout as one of a selection, if it keeps that."""
        arms = arms_of(self.cell, selection)
        if not known.keeps(selection) or any(a not in known.paths for a in arms):
            return None
        return tuple(known.paths[a].between(selection.first, selection.last) for a in arms)
