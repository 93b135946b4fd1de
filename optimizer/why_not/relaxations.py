"""Which changes of a request make a layout possible: each of them is tried on the whole cell."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence

import numpy as np

from models.cell import Cell
from optimizer.coupled.scene import Scene
from optimizer.coupled.sqp.refine import refine
from optimizer.findings import Relaxation
from optimizer.program import ArmPoint
from optimizer.why_not.changes import Change, Ladder, changes
from optimizer.why_not.conflict import Conflict, Known
from optimizer.why_not.elements import Selection, everything, restricted
from optimizer.why_not.trial import Found, find

SHARE = 0.3
"""Share of the time left that one trial may take."""
GUESSING = 5.0
"""s that may go into changes of what the conflict does not name: grasps, heights, smaller distances."""
FIRST_LOOK = 3
"""Combinations refined to see whether a change resolves the conflict."""
HINTS = 3
"""Known layouts tried before a search."""


def relaxations(cell: Cell, conflict: Conflict, deadline: float, seed: int) -> tuple[Relaxation, ...]:
    """Changes that help, the one with the best layout first.

    Args:
        cell: the whole cell. conflict: what blocks it.
        deadline: `time.perf_counter` value, soft; what has not been tried by then is left out.
        seed: of the searches.
    """
    sure = [ladder for ladder in changes(cell, conflict.selection) if ladder[0].undone]
    guesses = [ladder for ladder in changes(cell, conflict.selection) if not ladder[0].undone]
    found: list[Relaxation] = []
    for ladders, seconds in ((sure, np.inf), (guesses, GUESSING)):
        trials = _Trials(cell, conflict, min(deadline, time.perf_counter() + seconds), seed)
        found += [relaxation for ladder in ladders for relaxation in trials.climb(ladder)]
    return tuple(sorted(found, key=lambda relaxation: relaxation.objective))


class _Trials:
    """Tries changes of one cell."""

    def __init__(self, cell: Cell, conflict: Conflict, deadline: float, seed: int) -> None:
        self.cell, self.conflict, self.deadline, self.seed = cell, conflict, deadline, seed
        self.whole = everything(cell)

    def climb(self, ladder: Ladder) -> Iterable[Relaxation]:
        """The smallest change of a ladder that helps, going down until one does not."""
        helps: tuple[Change, Found] | None = None
        for change in ladder:
            found = self._try(change, [] if helps is None else [helps[1].points])
            if found is None:
                break
            helps = change, found
        return [] if helps is None else [Relaxation(helps[0].what, helps[0].pointer, helps[1].objective)]

    def _try(self, change: Change, hints: Sequence[tuple[ArmPoint, ...]]) -> Found | None:
        """A layout of the changed cell: of what blocked at first, which is quick to be refused, then of all."""
        if time.perf_counter() > self.deadline:
            return None
        if not change.undone:
            part = restricted(change.cell, self.conflict.selection)
            if find(part, self._soon(), seed=self.seed, starts=FIRST_LOOK).found is None:
                return None
        known = [self._hint(known) for known in self.conflict.known if self._may_do(known, change)]
        usable = [*hints, *(points for points in known if points)]
        found = find(change.cell, self._soon(), usable[:HINTS], self.seed).found
        return None if found is None else self._polished(change.cell, found)

    def _soon(self) -> float:
        now = time.perf_counter()
        return now + SHARE * (self.deadline - now)

    def _may_do(self, known: Known, change: Change) -> bool:
        """True if a known layout breaks nothing but what the change undoes."""
        rest = Selection(self.whole.elements - change.undone, self.whole.first, self.whole.last)
        return bool(change.undone) and known.keeps(rest)

    def _hint(self, known: Known) -> tuple[ArmPoint, ...]:
        return tuple(known.ways[a].point for a in range(len(self.cell.arms)) if a in known.ways)

    def _polished(self, cell: Cell, found: Found) -> Found:
        """The layout, locally best."""
        if not cell.coupled:
            return found
        better = refine(Scene.of(cell), found.points, self._soon())
        return Found(better.points, better.objective) if better.clean and better.objective < found.objective else found
