"""From what the arms and the coupled search found to one layout."""

from __future__ import annotations

from dataclasses import replace

from duocell.models.cell.cell import Cell
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.coupled.prove import against
from duocell.optimizer.coupled.report import alternatives, clearances_of, explain, placements_of
from duocell.optimizer.nlp.measure import segment_shares
from duocell.optimizer.reasons.reasons import name_segments
from duocell.optimizer.results.layout import Certificate, Layout, Outcome
from duocell.optimizer.verification.scene import Scene
from duocell.optimizer.verification.verify import check, summarise


def coupled_layout(cell: Cell, alone: Layout, search: CoupledSearch, most_alternatives: int) -> Layout:
    """The layout of a coupled cell.

    Args:
        cell: the cell. alone: what its arms would do without each other. search: of all of them together.
        most_alternatives: how many other layouts to report at most.

    Returns:
        ``alone`` with the coupled answer in place of the arms' own. A cell without a usable layout keeps the placements
        of the least violating one, with the clearances that it has.
    """
    shown = search.best or search.nearest
    reasons = search.reasons
    if search.best is None and not reasons and alone.certificate is not None:
        reasons = alone.certificate.reasons
    if search.best is None and not reasons:
        reasons = explain(Scene.of(cell), search.nearest, search.starts)
    placements = alone.placements if shown is None else placements_of(cell, shown)
    verification = alone.verification
    if shown is not None:
        verification = summarise([check(cell, arm, p) for arm, p in zip(cell.arms, shown.points, strict=True)])
    usable = search.best is not None
    objective = None if search.best is None else search.best.objective
    certificate = None if alone.certificate is None else against(alone.certificate, objective)
    return replace(
        alone,
        outcome=Outcome.of(usable=usable, proved=_proved(certificate, search)),
        objective=objective,
        placements=placements,
        reasons=name_segments(cell.task, reasons),
        search=replace(
            alone.search,
            candidates=alone.search.candidates + search.candidates,
            starts=alone.search.starts + search.starts,
            basins=max(alone.search.basins, len(search.found)),
            ended=alone.search.ended and search.finished,
        ),
        verification=verification,
        certificate=certificate,
        clearances=() if shown is None else clearances_of(shown),
        alternatives=alternatives(cell, search.found, most_alternatives),
        segments=segment_shares(cell, placements if usable else ()),
    )


def _proved(certificate: Certificate | None, search: CoupledSearch) -> bool:
    """Whether it is certain that the best layout is the best of all, or that there is none."""
    by_proof = certificate is not None and certificate.proved
    return by_proof or (search.best is None and search.proved)
