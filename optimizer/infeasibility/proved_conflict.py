"""An irreducible infeasible set (IIS) by proofs: what leaves one arm, or two arms together, without a layout.

A deletion filter: one requirement after the other is left out of what is proved to leave no layout. Where the rest
still leaves none it stays out; where a layout turns up it is needed. What excluded no box is out at no cost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

from duocell.models.cell.cell import Cell
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.requirements import (
    Kind,
    Requirement,
    Selection,
    by_interest,
    restricted,
    selection_of,
)
from duocell.optimizer.infeasibility.sampled import sampled_layout
from duocell.optimizer.infeasibility.subset_proof import REBUILT, SubsetProof
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.verification.scene import Scene

WHOLE = 0.8
"""Share of the effort for the proof that there is a conflict."""
TRIAL = 0.35
"""Share of what is then left that a proof without one of the requirements may take."""
FILTER = 0.7
"""Share of what is left for requirements; the rest is for poses."""
SOON = 0.8
"""s worth of such a proof, at first."""
OF_JOINTS = (Kind.STEP, Kind.SINGULARITIES, Kind.LIMITS)
"""What is left out together first: it often excludes what would be excluded all the same."""


@dataclass(frozen=True, eq=False, slots=True)
class Conflict:
    """What leaves no layout.

    Attributes:
        selection: requirements and poses. irreducible: True if for every one of them, and for the first and the last
            pose, a layout of the others is known. proved: False if that was searched and not proved.
        without: layouts of the arms in the selection that keep everything else of it, by what they do without.
        finish: leaves out what is not needed, for a conflict of which that has not been tried yet; else None.
    """

    selection: Selection
    irreducible: bool
    proved: bool = True
    without: dict[Requirement, tuple[ArmSolution, ...]] = field(default_factory=dict)
    finish: Callable[[Effort], Conflict] | None = None

    @property
    def together(self) -> bool:
        """True if several arms are concerned."""
        return sum(one.kind is Kind.ARM for one in self.selection.requirements) > 1


def proved_conflict(cell: Cell, effort: Effort) -> Conflict | tuple[ArmSolution, ...] | None:
    """A conflict of one arm, else of two; a layout of the whole cell should one turn up; None where nothing is proved.

    Args:
        cell: the cell. effort: that may be spent.
    """
    if any(reduced_problem(cell, arm) is None for arm in cell.arms):
        return None
    possible = 0  # arms that have a layout by themselves
    for arms in (*((a,) for a in range(len(cell.arms))), *combinations(range(len(cell.arms)), 2)):
        proof = SubsetProof(cell, selection_of(cell, arms))
        proof.run(effort.share(WHOLE))
        if proof.infeasible:
            found = _Filter(proof, known=len(arms) == 1 or possible == len(cell.arms))
            return found.filtered(effort) if len(arms) == 1 else found.begun(effort)
        if proof.layout is not None and len(arms) == len(cell.arms):
            return proof.layout
        possible += len(arms) == 1 and proof.layout is not None
    return None


class _Filter:
    """The deletion filter of one proof."""

    def __init__(self, proof: SubsetProof, known: bool) -> None:
        """``known``: the arms have layouts one by one."""
        self.proof, self.known = proof, known
        self.without: dict[Requirement, tuple[ArmSolution, ...]] = {}

    def begun(self, effort: Effort) -> Conflict:
        """Layouts are looked for first: of two arms samples are quicker than pairs of boxes where there is one."""
        unused = (one for (one,) in self._groups()[1:] if one.kind not in REBUILT and not self.proof.weight(one))
        self.proof.selection = self.proof.selection.without(*unused)
        self._look_for_layouts(effort)
        return Conflict(self.proof.selection, irreducible=False, without=self.without, finish=self.finished)

    def finished(self, effort: Effort) -> Conflict:
        """No more requirements and poses than it takes, as far as the effort goes."""
        self.filtered(effort.share(FILTER))
        return self._shortened(effort)

    def filtered(self, effort: Effort) -> Conflict:
        """No more requirements than it takes; the poses are still to be looked at.

        What soon turns out not to be needed is left out first; then proofs of what is still open have more time.
        """
        for group in self._groups():
            self._leave_out(group, effort)
        open_ = [one for (one,) in reversed(self._groups()[1:]) if one not in self.without]
        for number, requirement in enumerate(open_):
            smaller = self.proof.without([requirement])
            smaller.run(effort.share(max(TRIAL, 1.0 / (len(open_) - number))))
            self._learn(smaller, [requirement])
        return Conflict(self.proof.selection, irreducible=False, without=self.without, finish=self._shortened)

    def _shortened(self, effort: Effort) -> Conflict:
        """No more poses than it takes."""
        needed = {one for one in self.proof.selection.requirements if one.kind is not Kind.ARM}
        selection, ended = _shortened(self.proof, effort)
        return Conflict(selection, self.known and ended and needed <= self.without.keys(), without=self.without)

    def _look_for_layouts(self, effort: Effort) -> None:
        """Samples without one requirement after the other, limits of single joints last."""
        some = [one for (one,) in self._groups()[1:] if one.kind in REBUILT or self.proof.weight(one)]
        some.sort(key=lambda one: one.kind in OF_JOINTS)
        for requirement in some:
            if effort.over:
                return
            smaller = restricted(self.proof.whole, self.proof.selection.without(requirement))
            problems = [reduced_problem(smaller, arm) for arm in smaller.arms]
            known = [problem for problem in problems if problem is not None]
            found = sampled_layout(Scene.of(smaller), known, effort, 0)
            if found is not None:
                self.without[requirement] = found.points

    def _leave_out(self, group: Sequence[Requirement], effort: Effort) -> None:
        """Try to do without some requirements, those of them that excluded nothing at no cost."""
        group = [one for one in group if one in self.proof.selection.requirements and one not in self.without]
        used = [one for one in group if one.kind in REBUILT or self.proof.weight(one)]
        self.proof.selection = self.proof.selection.without(*(one for one in group if one not in used))
        if used:
            smaller = self.proof.without(used)
            smaller.run(effort.share(min(TRIAL, SOON / max(effort.left, SOON))))
            self._learn(smaller, used)

    def _learn(self, smaller: SubsetProof, left_out: Sequence[Requirement]) -> None:
        if smaller.infeasible:
            self.proof = smaller
        elif smaller.layout is not None and len(left_out) == 1:
            self.without[left_out[0]] = smaller.layout

    def _groups(self) -> list[list[Requirement]]:
        """What to leave out in turn: the limits of joints and steps together, then one by one.

        Those first that excluded least, and last what changes the roots of the trees.
        """
        some = [one for one in by_interest(self.proof.selection.requirements) if one.kind is not Kind.ARM]
        weights = {one: self.proof.weight(one) for one in some}
        some.sort(key=lambda one: (one.kind in REBUILT, weights[one]))
        return [[one for one in some if one.kind in OF_JOINTS], *([one] for one in some)]


def _shortened(proof: SubsetProof, effort: Effort) -> tuple[Selection, bool]:
    """No more poses than it takes, by bisection at both ends; and whether that was decided for the ends that are left.

    Where some poses leave no layout, more of them leave none either.
    """
    selection, ended = proof.selection, True
    for end in ("last", "first"):
        enough, fewer = getattr(selection, end), selection.first - 1 if end == "last" else selection.last + 1
        while abs(enough - fewer) > 1:
            middle = (enough + fewer) // 2
            shorter = SubsetProof(proof.whole, replace(selection, **{end: middle}))
            shorter.run(effort.share(TRIAL))
            ended &= shorter.decided
            enough, fewer = (middle, fewer) if shorter.infeasible else (enough, middle)
        selection = replace(selection, **{end: enough})
    return selection, ended
