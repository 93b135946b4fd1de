"""What goes beyond the answer: how exactly it has to be built, or what stands in the way of one."""

from __future__ import annotations

from dataclasses import replace

from models.cell import Cell
from optimizer.layout import Layout, Outcome
from optimizer.settings import Settings
from optimizer.tolerance.tolerance import tolerance_of


def with_advice(cell: Cell, layout: Layout, settings: Settings) -> Layout:
    """The layout with what is asked for: its installation tolerance."""
    if layout.outcome is not Outcome.INFEASIBLE and settings.tolerance is not None:
        tolerance = tolerance_of(cell, layout.placements, layout.clearances, settings.tolerance, settings.seed)
        return replace(layout, tolerance=tolerance)
    return layout
