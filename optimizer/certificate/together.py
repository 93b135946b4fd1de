"""The certificate of a cell that is proved as a whole: its arms among their surroundings, then pairs of them."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.optimizer.certificate.cell_proof import ArmPart, CellProof, prove_cell
from duocell.optimizer.certificate.words import reasons_of
from duocell.optimizer.monitoring.events import Bounded
from duocell.optimizer.monitoring.watch import tell
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.results.layout import ArmCertificate, Certificate
from duocell.optimizer.results.proof import relative_gap
from duocell.optimizer.settings import CertificateSettings
from duocell.optimizer.sqp.refine import Refined
from duocell.optimizer.verification.scene import Scene

log = logging.getLogger(__name__)


def prove_together(
    cell: Cell,
    problems: Sequence[ReducedProblem],
    known: Sequence[Refined],
    settings: CertificateSettings,
    report: Callable[[str, float], None],
) -> tuple[Certificate, CellProof]:
    """Bound a cell's objective over all that the request allows.

    Args:
        cell: the cell. problems: reduced problems of its arms on the full task, in order.
        known: its clean layouts, best first.
        settings: gap to reach; time limit and boxes.
        report: told what is being done and the share of it that is done.

    Returns:
        The certificate, its gap measured against the best layout, and the proof: it may know a better layout.
    """
    began = time.perf_counter()
    best = known[0].objective if known else np.inf

    def told(lower: float, objective: float | None, boxes: int) -> None:
        bound = None if np.isinf(lower) else float(lower)
        gap = None if bound is None or objective is None else relative_gap(objective, bound)
        tell(Bounded("", bound, objective, gap, boxes))
        report("proving the cell", _share(settings, time.perf_counter() - began, boxes))

    proof = prove_cell(Scene.of(cell), problems, known, settings, told)
    if proof.known and proof.known[0].objective < best * (1.0 - 1e-6):
        log.warning("the proof found a better layout than the search: %.9g, not %.9g", proof.known[0].objective, best)
    return _certificate(cell, proof, settings, time.perf_counter() - began), proof


def _share(settings: CertificateSettings, seconds: float, boxes: int) -> float:
    """Of the budget that is used up."""
    by_boxes = 0.0 if settings.boxes is None else boxes / max(settings.boxes, 1)
    return min(max(by_boxes, seconds / max(settings.time_limit, 1e-9)), 1.0)


def _certificate(cell: Cell, proof: CellProof, settings: CertificateSettings, wall_time: float) -> Certificate:
    objective = proof.known[0].objective if proof.known else None
    bounded = objective is not None
    lower = min(proof.lower, objective) if objective is not None else None
    gap = None if objective is None or lower is None else relative_gap(objective, lower)
    return Certificate(
        lower_bound=None if lower is None else float(lower),
        gap=gap,
        proved=proof.infeasible or (gap is not None and gap <= settings.gap),
        boxes=proof.boxes,
        wall_time=wall_time,
        arms=tuple(_of_arm(arm.name, part, bounded) for arm, part in zip(cell.arms, proof.arms, strict=True)),
        wanted=settings.gap,
        infeasible=proof.infeasible,
        reasons=reasons_of(cell, proof),
        ended=proof.ended,
    )


def _of_arm(name: str, part: ArmPart, bounded: bool) -> ArmCertificate:
    """One arm by itself among its surroundings; ``bounded``: bounds of the cost were of interest."""
    if part.infeasible:
        note = "proved infeasible: no base in the region can do the task among its surroundings"
        return ArmCertificate(name, None, None, True, part.boxes, 0.0, note)
    if not bounded:
        return ArmCertificate(name, None, None, False, part.boxes, 0.0, "no layout of the cell is known")
    own = part.tree.alone
    gap = None if own is None else relative_gap(own.objective, part.lower)
    note = "by itself among its surroundings, as far as the proof of the cell needed it"
    return ArmCertificate(name, float(part.lower), gap, False, part.boxes, 0.0, note)
