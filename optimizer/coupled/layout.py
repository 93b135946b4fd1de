"""From what the arms and the coupled search found to one layout."""

from __future__ import annotations

from dataclasses import replace

from models.cell import Cell
from optimizer.coupled.report import alternatives, clearances_of, explain, placements_of
from optimizer.coupled.scene import Scene
from optimizer.coupled.search import CoupledSearch
from optimizer.layout import Certificate, Layout, Outcome
from optimizer.measure import jobs_of
from optimizer.prove import relative_gap
from optimizer.reasons import name_jobs
from optimizer.verify import check, summarise


def coupled_layout(cell: Cell, alone: Layout, search: CoupledSearch, most_alternatives: int) -> Layout:
    """The layout of a coupled cell.

    Args:
        cell: the cell. alone: what its arms would do without each other. search: of all of them together.
        most_alternatives: how many other layouts to report at most.

    Returns:
        ``alone`` with the coupled answer in place of the arms' own. An infeasible cell keeps the placements of the
        least violating layout, with the clearances that it has.
    """
    shown = search.best or search.nearest
    reasons = search.reasons
    if search.best is None and not reasons:
        reasons = explain(Scene.of(cell), search.nearest, search.starts)
    placements = alone.placements if shown is None else placements_of(cell, shown)
    verification = alone.verification
    if shown is not None:
        verification = summarise([check(cell, arm, p) for arm, p in zip(cell.arms, shown.points, strict=True)])
    certificate = None if alone.certificate is None else _against(alone.certificate, search)
    outcome = Outcome.INFEASIBLE
    if search.best is not None:
        outcome = Outcome.OPTIMAL if search.finished and alone.outcome is Outcome.OPTIMAL else Outcome.FEASIBLE
    return replace(
        alone,
        outcome=outcome,
        objective=None if search.best is None else search.best.objective,
        placements=placements,
        reasons=name_jobs(cell.task, reasons),
        proved=search.proved or (certificate is not None and certificate.proved and search.best is not None),
        search=replace(
            alone.search,
            candidates=alone.search.candidates + search.candidates,
            starts=alone.search.starts + search.starts,
            basins=max(alone.search.basins, len(search.found)),
        ),
        verification=verification,
        certificate=certificate,
        clearances=() if shown is None else clearances_of(shown),
        alternatives=alternatives(cell, search.found, most_alternatives),
        jobs=jobs_of(cell, () if search.best is None else placements),
    )


def _against(certificate: Certificate, search: CoupledSearch) -> Certificate:
    """The arms' own bounds, whose sum bounds the coupled cell too, against the coupled answer."""
    if search.best is None or certificate.lower_bound is None:
        return replace(certificate, gap=None, proved=False)
    gap = relative_gap(search.best.objective, certificate.lower_bound)
    return replace(certificate, gap=gap, proved=gap <= certificate.wanted)
