"""Why two arms have no layout together: proofs over pairs of boxes, and what of their cell these need."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.cell import Cell
from optimizer.certificate.cell_proof import CellProof, prove_cell
from optimizer.coupled.scene import Scene
from optimizer.infeasibility.arm_conflict import elements_of
from optimizer.program import ArmPoint
from optimizer.reduced import reduced_problem
from optimizer.settings import CertificateSettings
from optimizer.why_not.elements import OWN, Element, Kind, Selection, by_interest, everything, restricted

BOXES = 12_000
"""Of one proof at most; pairs count for less than one."""
SHARE = 0.5
"""Of the time left that a proof without some of the elements may take."""


@dataclass(frozen=True, eq=False, slots=True)
class PairConflict:
    """Arms that have no layout together, proved; or a layout of the whole cell that the proof met.

    Attributes:
        selection: what leaves no layout. irreducible: True if for every member but arms and poses a layout without it
            is known. layout: one point per arm, or None.
    """

    selection: Selection
    irreducible: bool
    layout: tuple[ArmPoint, ...] | None = None


def pair_conflict(cell: Cell, deadline: float) -> PairConflict | None:
    """The proof for a cell of two arms or more that have layouts by themselves; None where there is none in time.

    Args:
        cell: the cell. deadline: `time.perf_counter` value, soft.
    """
    if len(cell.arms) < 2:
        return None
    whole = everything(cell)
    proof = _proof(cell, deadline)
    if proof is not None and proof.known:
        return PairConflict(whole, irreducible=False, layout=proof.known[0].points)
    if proof is None or not proof.infeasible:
        return None
    arms = {e for e in whole.elements if e.kind is Kind.ARM}
    regions = {e for e in whole.elements if e.kind is Kind.REGION}
    used = _by_weight(cell, proof, whole)
    chosen, irreducible = _enough(cell, arms | regions, used, deadline), True
    for element in [*(e for e in reversed(used) if e in chosen), *by_interest(regions)]:
        smaller = _proof_of(cell, chosen - {element}, deadline)
        if smaller is not None and smaller.infeasible:
            chosen.discard(element)
        else:
            irreducible &= smaller is not None and bool(smaller.known)
    return PairConflict(Selection(frozenset(chosen), whole.first, whole.last), irreducible)


def _proof(cell: Cell, deadline: float) -> CellProof | None:
    problems = [reduced_problem(cell, arm) for arm in cell.arms]
    known = [problem for problem in problems if problem is not None]
    left = deadline - time.perf_counter()
    if len(known) < len(problems) or left <= 0.0:
        return None
    return prove_cell(Scene.of(cell), known, [], CertificateSettings(1.0, left, BOXES))


def _proof_of(cell: Cell, chosen: set[Element] | frozenset[Element], deadline: float) -> CellProof | None:
    now = time.perf_counter()
    left = Selection(frozenset(chosen), 0, len(cell.task) - 1)
    return _proof(restricted(cell, left), now + SHARE * max(deadline - now, 0.0))


def _by_weight(cell: Cell, proof: CellProof, whole: Selection) -> list[Element]:
    """Elements but arms and regions, those first that excluded most boxes, what is the arms' own last."""
    weight: dict[Element, int] = {}
    for index, part in enumerate(proof.arms):
        causes = part.tree.excluder.causes
        counts = np.bincount(part.tree.nodes.code, minlength=len(causes))
        for element, numbers in elements_of(cell, index, causes.all).items():
            weight[element] = weight.get(element, 0) + int(np.sum(counts[numbers]))
    some = [e for e in by_interest(whole.elements) if e.kind not in (Kind.ARM, Kind.REGION)]
    some.sort(key=lambda e: (e.kind in OWN, e.kind is not Kind.COUPLING, -weight.get(e, 0)))
    return [e for e in some if e.kind not in OWN or weight.get(e, 0) > 0]


def _enough(cell: Cell, always: set[Element], used: Sequence[Element], deadline: float) -> set[Element]:
    """The first so many of some elements that leave no layout; all of them together do."""
    count = 1
    while count < len(used):
        proof = _proof_of(cell, always | set(used[:count]), deadline)
        if proof is not None and proof.infeasible:
            break
        count *= 2
    return always | set(used[:count])
