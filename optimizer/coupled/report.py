"""What a coupled search tells its user: other layouts and why one might prefer them, or what is in the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.cell.one_place import in_one_place
from duocell.optimizer.clearance.clearance import found_clearances
from duocell.optimizer.nlp.measure import placed
from duocell.optimizer.reasons.faults import coupling_faults, floor_faults, path_faults
from duocell.optimizer.results.findings import Alternative, Clearance
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.results.placement import Placement
from duocell.optimizer.sqp.refine import Refined
from duocell.optimizer.verification.scene import Scene

NOTICEABLE = 0.05
"""Relative gain of a figure that is worth a word."""


def placements_of(cell: Cell, refined: Refined) -> tuple[Placement, ...]:
    """One placement per arm."""
    return tuple(placed(cell, arm, point) for arm, point in zip(cell.arms, refined.points, strict=True))


def clearances_of(refined: Refined) -> tuple[Clearance, ...]:
    """What the layout keeps; empty where nothing was asked for or checked."""
    return () if refined.clearance is None else found_clearances(refined.clearance)


def alternatives(cell: Cell, found: Sequence[Refined], most: int) -> tuple[Alternative, ...]:
    """The layouts after the first, best first."""
    if not found:
        return ()
    best = _Figures(cell, found[0])
    possible = [one for one in found[1:] if not in_one_place(cell.arms, [point.position for point in one.points])]
    return tuple(
        Alternative(one.objective, figures.placements, figures.clearances, figures.against(best))
        for one in possible[:most]
        for figures in (_Figures(cell, one),)
    )


class _Figures:
    """Numbers by which layouts are compared."""

    def __init__(self, cell: Cell, refined: Refined) -> None:
        self.objective = refined.objective
        self.placements = placements_of(cell, refined)
        self.clearances = clearances_of(refined)
        self.margin = min(placement.minimum_margin for placement in self.placements)
        self.conditioning = min(placement.minimum_conditioning for placement in self.placements)
        self.room = min((c.distance - c.required for c in self.clearances if c.kind != "part_obstacle"), default=None)

    def against(self, best: _Figures) -> str:
        """Why one might prefer this layout."""
        gains = []
        if self.margin > best.margin * (1.0 + NOTICEABLE):
            gains.append(f"smallest joint margin {self.margin:.3f} rad instead of {best.margin:.3f} rad")
        if self.conditioning > best.conditioning * (1.0 + NOTICEABLE):
            gains.append(f"conditioning {self.conditioning:.3f} instead of {best.conditioning:.3f}")
        if self.room is not None and best.room is not None and self.room > best.room + 1e-3:
            gains.append(f"{(self.room - best.room) * 1e3:.0f} mm more room beyond the clearances")
        cost = f"objective {100.0 * (self.objective / max(best.objective, 1e-9) - 1.0):.1f} % higher"
        return f"{'; '.join(gains) or 'other places, should the best ones not be available'} ({cost})"


def explain(scene: Scene, nearest: Refined | None, starts: int) -> tuple[Reason, ...]:
    """Why no layout is clean, told by the least violating one that was found."""
    if nearest is None:
        return (Reason("", "coupling", (), "no combination of the arms' placements was found at all"),)
    evidence = f"the best of {starts} layouts that were tried"
    places = [np.append(point.position, point.yaw) for point in nearest.points]
    clearance = nearest.clearance or scene.certify(nearest.points)
    reasons = [
        *coupling_faults(scene.cell, places),
        *floor_faults(scene.cell, places),
        *path_faults(scene.cell, clearance),
    ]
    if not reasons:
        return (Reason("", "coupling", (), f"{evidence} does not pass the final check"),)
    return tuple(replace(reason, detail=f"{reason.detail} (in {evidence})") for reason in reasons)
