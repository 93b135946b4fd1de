"""Arms that would stand in one place: the search is told that they must not, and only then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling.apart import Apart
from duocell.models.cell.one_place import NEAREST, in_one_place, one_machine
from duocell.optimizer.nlp.program import ArmSolution


def kept_apart(cell: Cell, points: Sequence[ArmSolution]) -> Cell:
    """The cell with couplings that keep apart what stands in one place in a layout; itself where nothing does.

    Args:
        cell: the cell. points: one per arm.
    """
    pairs = [(first, second) for first, second, _ in in_one_place(cell.arms, [one.position for one in points])]
    return _with_couplings(cell, pairs)


def all_kept_apart(cell: Cell) -> Cell:
    """The cell with such couplings for every two arms, but for the sides of one machine."""
    pairs = combinations(range(len(cell.arms)), 2)
    return _with_couplings(cell, [pair for pair in pairs if not one_machine(*(cell.arms[arm] for arm in pair))])


def _with_couplings(cell: Cell, pairs: Sequence[tuple[int, int]]) -> Cell:
    there = {coupling.arms for coupling in cell.couplings if isinstance(coupling, Apart)}
    more = tuple(Apart(pair, NEAREST) for pair in pairs if pair not in there)
    return replace(cell, couplings=(*cell.couplings, *more)) if more else cell
