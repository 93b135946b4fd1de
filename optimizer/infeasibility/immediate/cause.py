"""A reason, proved by itself, why a cell has no layout."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.results.layout import Reason

SURE = 3.8e-6
"""m; what a proof needs beyond `KEPT`: two bases that are out of their regions by as much along a diagonal (2√3 of it),
or errors of two hands that still count as none; and those of distances of Coal."""


@dataclass(frozen=True, slots=True)
class Infeasibility:
    """A cause of infeasibility.

    Attributes:
        kind: word of a `Reason`: collision | out_of_reach | floor | coupling.
        detail: one sentence, with what would help.
        arms: indices of the arms concerned. poses: likewise.
        bodies: names of the two bodies that come too near, or ().
        pair_class: of the clearance that cannot be kept, or None.
        required: what is asked for, in ``unit``; None where there is no number.
        possible: the largest value of what is asked for that this cause would leave possible; None if there is none.
        missing: what is missing at least, in ``unit``; None where there is no number.
        pointer: JSON pointer to the field of the request that asks for it.
        unit: "m", "rad" or "".
    """

    kind: str
    detail: str
    arms: tuple[int, ...] = ()
    poses: tuple[int, ...] = ()
    bodies: tuple[str, ...] = ()
    pair_class: PairClass | None = None
    required: float | None = None
    possible: float | None = None
    missing: float | None = None
    pointer: str = ""
    unit: str = ""

    def reason(self, cell: Cell) -> Reason:
        """The cause as a reason of a layout."""
        arm = cell.arms[self.arms[0]].name if self.arms else ""
        unit = self.unit if self.missing is not None else ""
        return Reason(arm, self.kind, self.poses, self.detail, amount=self.missing, unit=unit)


def surely_short(distance: float, required: float) -> bool:
    """True if a distance [m] is missed by more than counts as kept, rounding included."""
    return distance < required - KEPT - SURE


def rounded_down(distance: float) -> float:
    """A distance [m] rounded down to a tenth of a millimetre, so that it can be kept."""
    return floor(1e4 * (distance + KEPT)) / 1e4


def millimetres(distance: float) -> str:
    """A distance [m] as text."""
    return f"{1e3 * distance:.1f}".removesuffix(".0") + " mm"
