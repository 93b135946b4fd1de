"""Changes of a request by a number: the smallest one that leaves a layout, found by solving the changed cell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.infeasibility.changes.candidates import candidates
from duocell.optimizer.infeasibility.changes.poses import more_poses
from duocell.optimizer.infeasibility.changes.remedy import Remedy
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.immediate.immediate import immediate_infeasibility
from duocell.optimizer.infeasibility.proved_conflict import Conflict
from duocell.optimizer.infeasibility.requirements import Kind
from duocell.optimizer.infeasibility.resolve import resolved
from duocell.optimizer.infeasibility.sampled import least_layouts
from duocell.optimizer.infeasibility.searched.trial import Found, clean
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.results.findings import Relaxation
from duocell.optimizer.verification.scene import Scene

CLOSE = 0.1
"""Relative width of the interval that holds the smallest number, where the search for it ends."""
GROWTH = 2.5
"""Factor between the numbers that are tried first, from below."""
FIRST, SHARE = 0.7, 0.3
"""Shares of what is left for a remedy: for the trial that tells whether anything helps, and those for less of it."""
EACH = 0.5
"""Share of what is left that one remedy may take."""
ROUNDS = (0.15, 0.6, 0.6, 0.6)
"""Densities of the samples in which the least amount is looked for, as long as that becomes less."""
HALVINGS = 6
"""Of the amount, before another layout is looked for."""
MOST_TOLD = 3
MORE = 2.5
"""s worth that may be spent after a change that helps, for others."""
LAST = "/base/z"
"""What the pointer of a change ends in that is looked at only where no other helps: free heights are dear."""
MOVED = "/obstacles/"
"""What pointers of obstacles begin with."""


@dataclass(frozen=True, eq=False, slots=True)
class Helpful:
    """A change and an amount of it for which a layout is known."""

    remedy: Remedy
    amount: float
    found: Found

    @property
    def words(self) -> str:
        """The change in words."""
        return self.remedy.words(self.amount)


@dataclass(frozen=True, eq=False, slots=True)
class Bracket:
    """Amounts: ``low`` does not help, ``first`` may."""

    low: float
    first: float


def remedies(
    cell: Cell, conflict: Conflict, effort: Effort, seed: int, possible: Mapping[str, float] | None = None
) -> tuple[Relaxation, ...]:
    """The smallest changes that help, at most `MOST_TOLD`, the cheapest first; each has a layout.

    Args:
        cell: the cell. conflict: what blocks it. seed: of the searches.
        effort: that may be spent; what has not been solved with it is not told.
        possible: by JSON pointer, the largest value that was found possible, if no more than `PRECISE` below the bound.
    """
    told: list[Relaxation] = []
    touching = False  # it is proved that even that would not be enough
    hints = [points for points in conflict.without.values() if len(points) == len(cell.arms)]
    some = _in_turn(cell, conflict)
    for number, remedy in enumerate(some):
        if len(told) >= MOST_TOLD or effort.over:
            break
        if told and remedy.pointer.endswith(LAST):
            continue
        own = effort.share(max(EACH, 1.0 / (len(some) - number)))
        helpful = _helpful(cell, conflict, remedy, hints, own, seed, possible or {})
        if isinstance(helpful, Helpful):
            hints.insert(0, helpful.found.points)
            effort = effort if told else effort.share(min(1.0, MORE / max(effort.left, MORE)))
            told += _told(cell, helpful, touching)
        touching |= helpful is True and remedy.pointer == f"/clearance/{PairClass.ARM_OBSTACLE}"
    return tuple(told[:MOST_TOLD])


def _told(cell: Cell, helpful: Helpful, touching: bool) -> list[Relaxation]:
    """In words; where longer joint steps help, more poses may as well."""
    pointer = helpful.remedy.pointer
    only = "; no smaller clearance is enough" if touching and pointer.startswith(MOVED) else ""
    found = [Relaxation(helpful.words + only, pointer, helpful.found.objective)]
    if helpful.remedy.undoes is not None and helpful.remedy.undoes.kind is Kind.STEP:
        more = more_poses(cell, helpful.found.points)
        found += [] if more is None else [more]
    return found


def _in_turn(cell: Cell, conflict: Conflict) -> list[Remedy]:
    """Changes of what is known to be needed first; of one arm clearances before them, which its tree tells.

    Where nothing is known to be needed, those first that samples tell: these cost least to be looked at.
    """
    some = list(candidates(cell, conflict.selection))
    if conflict.together and conflict.without and conflict.finish is not None:
        return [one for one in some if one.undoes in conflict.without]

    def turn(one: Remedy) -> int:
        if one.need is not None and (one.undoes in conflict.without or not conflict.without):
            return 0
        return 1 if one.undoes is None or one.undoes in conflict.without else 2

    return sorted(some, key=turn)


def _helpful(
    cell: Cell,
    conflict: Conflict,
    remedy: Remedy,
    hints: Sequence[tuple[ArmSolution, ...]],
    effort: Effort,
    seed: int,
    possible: Mapping[str, float],
) -> Helpful | bool:
    """The smallest amount that helps; True if it is proved that none does; False where none is found."""
    arms = [one.index for one in conflict.selection.requirements if one.kind is Kind.ARM]
    sampled = None if remedy.need is None else least_sampled(remedy, effort, seed)
    if remedy.pointer in possible:
        less = remedy.required - possible[remedy.pointer]
        first = min(_rounded(less, remedy.exact), remedy.most)
        bracket: Bracket | None = Bracket(less - 2.0 * remedy.exact, first)
    else:
        bracket = bracket_of(remedy, arms, effort)
    if bracket is None:
        return True
    if remedy.undoes is None:
        sampled = least_sampled(remedy, effort, seed)
    hints = hints if sampled is None else [sampled.found.points, *hints]
    helpful = smallest(remedy, bracket, hints, effort, seed)
    return helpful if sampled is None or (isinstance(helpful, Helpful) and helpful.amount < sampled.amount) else sampled


def least_sampled(remedy: Remedy, effort: Effort, seed: int) -> Helpful | None:
    """The smallest amount that a layout among samples needs; the next samples are of what needs no more than that.

    Unlike a search by halves this does not have to find that a cell has no layout, which is what costs most.
    """
    best: Helpful | None = None
    for round_, density in enumerate(ROUNDS):
        amount = remedy.most if best is None else best.amount
        cell = remedy.change(amount)
        problems = [problem for arm in cell.arms if (problem := reduced_problem(cell, arm)) is not None]
        if effort.over or len(problems) < len(cell.arms):
            break
        found = least_layouts(Scene.of(cell), problems, remedy.need, density, seed + round_)
        effort.sampled(cell, density)
        some = [_shrunk(0.0, Helpful(remedy, amount, one)) for one in found if _does(cell, one.points)]
        best = min(some, key=lambda one: one.amount, default=best)
        if best is None or best.amount > (1.0 - CLOSE) * amount:
            break
    return best


def bracket_of(remedy: Remedy, arms: Sequence[int], effort: Effort) -> Bracket | None:
    """Where to look for the smallest amount; None if it is proved that none helps."""
    if remedy.kept is None:
        return Bracket(0.0, remedy.most)
    low, first = 0.0, 0.0
    for arm in arms:
        largest = remedy.kept(arm, effort.share(SHARE))
        if largest is None:
            continue
        if largest.bound == -np.inf:
            return None
        low = max(low, remedy.required - largest.bound)
        if largest.found is not None:
            first = max(first, remedy.required - largest.found)
    return Bracket(low, min(_rounded(first, remedy.exact), remedy.most) if first > 0.0 else remedy.most)


def smallest(
    remedy: Remedy, bracket: Bracket, hints: Sequence[tuple[ArmSolution, ...]], effort: Effort, seed: int
) -> Helpful | bool:
    """The smallest amount for which a layout is found; True if it is proved that none is; False where none is found.

    From above: a layout for a large amount does for smaller ones as well, which is quickly seen.
    """
    low, amount = bracket.low, bracket.first
    known = resolved(remedy.change(amount), hints, effort.share(FIRST if amount >= remedy.most else SHARE), seed)
    while known.found is None:
        if amount >= remedy.most or effort.over:
            return known.proved and amount >= remedy.most
        low, amount = amount, min(GROWTH * amount, remedy.most)
        known = resolved(remedy.change(amount), hints, effort.share(FIRST), seed)
    if remedy.fitted is not None:
        remedy = remedy.fitted(known.found.points)
        low, amount = 0.0, remedy.most
        if not _does(remedy.change(amount), known.found.points):
            return False
    helpful = _shrunk(low, Helpful(remedy, amount, known.found))
    while helpful.amount - low > max(CLOSE * helpful.amount, remedy.exact) and not effort.over:
        middle = _rounded(0.5 * (low + helpful.amount), remedy.exact)
        if not low < middle < helpful.amount:
            break
        found = resolved(remedy.change(middle), [helpful.found.points, *hints], effort.share(SHARE), seed).found
        if found is None:
            low = middle
        else:
            helpful = _shrunk(low, Helpful(remedy, middle, found))
    return helpful


def _shrunk(low: float, helpful: Helpful) -> Helpful:
    """The smallest amount, nearly, for which a layout that is known does as it is."""
    remedy, points, amount = helpful.remedy, helpful.found.points, helpful.amount
    if remedy.need is not None:  # halving would come down to it
        needed = _rounded(float(remedy.need([point.joints[None] for point in points])[0]), remedy.exact)
        if low < needed < amount and _does(remedy.change(needed), points):
            return Helpful(remedy, needed, helpful.found)
    for _ in range(HALVINGS + (4 if amount >= remedy.most else 0)):
        middle = _rounded(0.5 * (low + amount), remedy.exact)
        if not low < middle < amount:
            break
        if _does(remedy.change(middle), points):
            amount = middle
        else:
            low = middle
    return Helpful(remedy, amount, helpful.found)


def _does(cell: Cell, points: tuple[ArmSolution, ...]) -> bool:
    return not immediate_infeasibility(cell) and clean(Scene.of(cell), points)


def _rounded(amount: float, exact: float) -> float:
    return float(np.ceil(amount / exact - 1e-9) * exact)
