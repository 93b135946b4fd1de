"""Is there a layout of a changed cell? Proofs on the arms' trees first, then the nearest places to begin from."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from duocell.models.cell.cell import Cell
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.immediate.immediate import immediate_infeasibility
from duocell.optimizer.infeasibility.requirements import selection_of
from duocell.optimizer.infeasibility.sampled import first_layout, sampled_layout
from duocell.optimizer.infeasibility.searched.trial import Found, clean, find
from duocell.optimizer.infeasibility.subset_proof import SubsetProof
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.verification.scene import Scene

HINTS = 3
"""Known layouts that are tried at most."""
ARM = 0.3
"""Share of the effort that the proof of one arm may take."""


@dataclass(frozen=True, eq=False, slots=True)
class Resolved:
    """What is known of a changed cell: a layout that passes every check, or None; True if it is proved to have none."""

    found: Found | None
    proved: bool = False


def resolved(cell: Cell, hints: Sequence[tuple[ArmSolution, ...]], effort: Effort, seed: int) -> Resolved:
    """Look for a layout of a cell; the first one will do.

    Args:
        cell: any cell with arms. hints: layouts that may do, or nearly so, the best first.
        effort: that may be spent. seed: of the samples.
    """
    if immediate_infeasibility(cell):
        return Resolved(None, proved=True)
    scene, hints = Scene.of(cell), hints[:HINTS]
    for hint in hints:
        if clean(scene, hint):
            return Resolved(Found(tuple(hint), scene.objective(hint)))
    problems = [reduced_problem(cell, arm) for arm in cell.arms]
    known = [problem for problem in problems if problem is not None]
    if len(known) < len(problems):
        deadline = min(effort.deadline, time.perf_counter() + max(effort.left, 0.0))
        return Resolved(find(cell, deadline, hints, seed).found)
    alone = []
    for index in range(len(cell.arms)):
        proof = SubsetProof(cell, selection_of(cell, (index,)))
        proof.run(effort.share(ARM))
        if proof.infeasible:
            return Resolved(None, proved=True)
        own = proof.trees[0].alone
        alone += [] if own is None else [own.point]
    starts = [tuple(alone), *hints] if len(alone) == len(problems) else list(hints)
    found = first_layout(scene, starts, effort)
    return Resolved(sampled_layout(scene, known, effort, seed) if found is None else found)
