"""What a solve tells, besides its events, to whoever may have to end it: all that an answer can be made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from duocell.models.cell.cell import Cell
from duocell.optimizer.monitoring.events import Event

if TYPE_CHECKING:
    from duocell.optimizer.clearance.clearance import PathClearance
    from duocell.optimizer.nlp.program import ArmSolution
    from duocell.optimizer.results.layout import Layout


class Known(Event):
    """No news for a person, and not sent on."""

    __slots__ = ()


@dataclass(frozen=True, eq=False, slots=True)
class Usable(Known):
    """A usable layout of the whole cell, better than all before.

    Attributes:
        cell: it. points: one for every arm, in order. time: s since the start.
        path: the check of its whole way; None where no clearance is asked for, or it is not at hand.
    """

    kind: ClassVar[str] = "usable"
    cell: Cell
    points: tuple[ArmSolution, ...]
    time: float
    path: PathClearance | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Solved(Known):
    """The answer is known and verified; what follows only explains it.

    Attributes:
        layout: the answer, perhaps without explanation, tolerance and baselines.
    """

    kind: ClassVar[str] = "solved"
    layout: Layout
