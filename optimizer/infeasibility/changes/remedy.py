"""A change of a request by one number."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.largest import Largest
from duocell.optimizer.infeasibility.requirements import Requirement
from duocell.optimizer.nlp.program import ArmSolution

FARTHEST = 3.0
"""m that anything is moved or widened at most."""


@dataclass(frozen=True, eq=False, slots=True)
class Remedy:
    """A change of one number.

    Attributes:
        change: makes the cell for an amount; more of it never hurts. words: says it to people.
        pointer: JSON pointer to the field. least, most: amounts, the first to be tried and the largest.
        exact: decimal step, in the unit of the amount; amounts are rounded up to it.
        undoes: the requirement that it loosens; None for a clearance, which several of them share.
        kept: how much of what is asked for an arm can keep, by its index; None where no tree says so.
        required: what is asked for, where ``kept`` is given.
        fitted: the change that a layout of the cell for ``most`` suggests; None where there is but one.
        need: (K,) amounts that K layouts take, by the joints (K, m, n) of each arm at the poses; None where joints do
            not say it.
    """

    change: Callable[[float], Cell]
    words: Callable[[float], str]
    pointer: str
    least: float
    most: float
    exact: float
    undoes: Requirement | None = None
    kept: Callable[[int, Effort], Largest | None] | None = None
    required: float = 0.0
    fitted: Callable[[tuple[ArmSolution, ...]], Remedy] | None = None
    need: Callable[[Sequence[Floats]], Floats] | None = None
