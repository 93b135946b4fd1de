"""Changes of a request by a number: the smallest one that leaves a layout, found by solving the changed cell."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.cell import Cell
from models.surroundings import PairClass
from optimizer.coupled.scene import Scene
from optimizer.findings import Relaxation
from optimizer.infeasibility.arm_conflict import arm_conflict, proved_arm
from optimizer.infeasibility.changes import Remedy, candidates
from optimizer.infeasibility.immediate import immediate_infeasibility
from optimizer.infeasibility.resolve import resolved
from optimizer.program import ArmPoint
from optimizer.why_not.elements import Kind, Selection
from optimizer.why_not.trial import Found, clean

CLOSE = 0.1
"""Relative width of the interval that holds the smallest number, where the search for it ends."""
GROWTH = 2.5
"""Factor between the numbers that are tried first, from below."""
FIRST, SHARE = 0.7, 0.3
"""Of the time left that a trial may take: the one that tells whether anything helps, and those for less of it."""
EACH = 0.5
"""Of the time left that one remedy may take."""
HALVINGS = 6
"""Of the amount, before another layout is looked for."""
PROOF = 0.15
"""Of the time left that a proof before a trial may take."""
MOST_TOLD = 3
MORE = 3.0
"""s that may go on after a change that helps, for others."""
MOVED = ("/obstacles/", "/arms/")
"""What pointers of changes by metres begin with, besides the floor."""


@dataclass(frozen=True, eq=False, slots=True)
class _Helpful:
    amount: float
    found: Found


@dataclass(frozen=True, eq=False, slots=True)
class _Bracket:
    """Amounts: ``low`` does not help, ``first`` may."""

    low: float
    first: float


def combined_remedy(cell: Cell, conflict: Selection, end: float, seed: int) -> Relaxation | None:
    """Two changes by the same number that help together where neither does alone; None where none is found.

    The second is one of what still blocks an arm when the first has gone as far as it may.

    Args:
        cell: the cell. conflict: what blocks it. end: `time.perf_counter` value, soft. seed: of the searches.
    """
    for first in _lengths(cell, conflict):
        now = time.perf_counter()
        opened = first.change(first.most)
        next_one = arm_conflict(opened, now + PROOF * max(end - now, 0.0))
        if next_one is None:
            continue
        for second in _lengths(opened, next_one.selection):
            if second.pointer == first.pointer or time.perf_counter() > end:
                continue
            both = _together(first, second, next_one.selection)
            now = time.perf_counter()
            bracket = _bracket(both, (), now + EACH * (end - now))
            helpful = None if bracket is None else _smallest(both, bracket, (), now + EACH * (end - now), seed)
            if helpful is not None:
                return Relaxation(both.words(helpful.amount), both.pointer, helpful.found.objective)
    return None


def _lengths(cell: Cell, conflict: Selection) -> list[Remedy]:
    """Changes by metres: of obstacles first, then of floors and regions."""
    some = [r for r in candidates(cell, conflict) if r.pointer == "/floor" or r.pointer.startswith(MOVED)]
    return sorted(some, key=lambda remedy: not remedy.pointer.startswith(MOVED[0]))


def _together(first: Remedy, second: Remedy, conflict: Selection) -> Remedy:
    def change(amount: float) -> Cell:
        opened = first.change(amount)
        return next(r for r in candidates(opened, conflict) if r.pointer == second.pointer).change(amount)

    def words(amount: float) -> str:
        return f"{first.words(amount)}, and {second.words(amount)}"

    least, most = min(first.least, second.least), min(first.most, second.most)
    return Remedy(change, words, first.pointer, least, most, max(first.exact, second.exact))


def remedies(
    cell: Cell, conflict: Selection, end: float, seed: int, possible: Mapping[str, float] | None = None
) -> tuple[Relaxation, ...]:
    """The smallest changes that help, at most `MOST_TOLD`, the cheapest first; each has a layout.

    Args:
        cell: the cell. conflict: what blocks it.
        end: `time.perf_counter` value, soft; what has not been solved by then is not told.
        seed: of the searches.
        possible: by JSON pointer, the largest value that was found possible, if no more than `PRECISE` below the bound.
    """
    told: list[Relaxation] = []
    touching = False  # it is proved that even that would not be enough
    hints: list[tuple[ArmPoint, ...]] = []
    arms = [element.index for element in conflict.elements if element.kind is Kind.ARM]
    some = list(candidates(cell, conflict))
    for number, remedy in enumerate(some):
        now = time.perf_counter()
        if len(told) == MOST_TOLD or now > end:
            break
        deadline = now + max(EACH, 1.0 / (len(some) - number)) * (end - now)
        if possible and remedy.pointer in possible:
            less = remedy.required - possible[remedy.pointer]
            bracket: _Bracket | None = _Bracket(
                less - 2.0 * remedy.exact, min(_rounded(less, remedy.exact), remedy.most)
            )
        else:
            bracket = _bracket(remedy, arms, deadline)
        helpful = None if bracket is None else _smallest(remedy, bracket, hints, deadline, seed)
        if helpful is not None:
            hints.insert(0, helpful.found.points)
            end = min(end, time.perf_counter() + MORE)
            words = remedy.words(helpful.amount)
            if touching and remedy.pointer.startswith(MOVED[0]):
                words += "; no smaller clearance is enough"
            told.append(Relaxation(words, remedy.pointer, helpful.found.objective))
        touching |= bracket is None and remedy.pointer == f"/clearance/{PairClass.ARM_OBSTACLE}"
    return tuple(told)


def _bracket(remedy: Remedy, arms: Sequence[int], deadline: float) -> _Bracket | None:
    """Where to look for the smallest amount; None if it is proved that none helps."""
    if remedy.kept is None:
        hopeless = remedy.least < remedy.most and _hopeless(remedy.change(remedy.most), deadline)
        return None if hopeless else _Bracket(0.0, remedy.most)
    low, first = 0.0, 0.0
    for arm in arms:
        now = time.perf_counter()
        largest = remedy.kept(arm, now + SHARE * max(deadline - now, 0.0))
        if largest is None:
            continue
        if largest.bound == -np.inf:
            return None
        low = max(low, remedy.required - largest.bound)
        if largest.found is not None:
            first = max(first, remedy.required - largest.found)
    return _Bracket(low, min(_rounded(first, remedy.exact), remedy.most) if first > 0.0 else remedy.most)


def _smallest(
    remedy: Remedy, bracket: _Bracket, hints: Sequence[tuple[ArmPoint, ...]], deadline: float, seed: int
) -> _Helpful | None:
    """The smallest amount for which a layout is found; None where none is in time.

    From above: a layout for a large amount does for smaller ones as well, which is quickly seen.
    """
    low, amount = bracket.low, bracket.first
    found = _solved(remedy.change(amount), hints, deadline, seed, FIRST)
    while found is None:
        if amount >= remedy.most or time.perf_counter() > deadline:
            return None
        low, amount = amount, min(GROWTH * amount, remedy.most)
        found = _solved(remedy.change(amount), hints, deadline, seed, FIRST)
    helpful = _shrunk(remedy, low, _Helpful(amount, found))
    while helpful.amount - low > max(CLOSE * helpful.amount, remedy.exact) and time.perf_counter() < deadline:
        middle = _rounded(0.5 * (low + helpful.amount), remedy.exact)
        if not low < middle < helpful.amount:
            break
        found = _solved(remedy.change(middle), [helpful.found.points, *hints], deadline, seed)
        if found is None:
            low = middle
        else:
            helpful = _shrunk(remedy, low, _Helpful(middle, found))
    return helpful


def _shrunk(remedy: Remedy, low: float, helpful: _Helpful) -> _Helpful:
    """The smallest amount, nearly, for which a layout that is known does as it is."""
    points, amount = helpful.found.points, helpful.amount
    for _ in range(HALVINGS):
        middle = _rounded(0.5 * (low + amount), remedy.exact)
        if not low < middle < amount:
            break
        if _does(remedy.change(middle), points):
            amount = middle
        else:
            low = middle
    return _Helpful(amount, helpful.found)


def _does(cell: Cell, points: tuple[ArmPoint, ...]) -> bool:
    return not immediate_infeasibility(cell) and clean(Scene.of(cell), points)


def _hopeless(cell: Cell, deadline: float) -> bool:
    """True if a cell is proved to have no layout."""
    now = time.perf_counter()
    return bool(immediate_infeasibility(cell)) or proved_arm(cell, now + PROOF * max(deadline - now, 0.0)) is not None


def _rounded(amount: float, exact: float) -> float:
    return float(np.ceil(amount / exact - 1e-9) * exact)


def _solved(
    cell: Cell, hints: Sequence[tuple[ArmPoint, ...]], deadline: float, seed: int, share: float = SHARE
) -> Found | None:
    """A layout of a cell that passes every check, looked for in a share of the time that is left."""
    now = time.perf_counter()
    return resolved(cell, hints[:MOST_TOLD], now + share * max(deadline - now, 0.0), seed).found
