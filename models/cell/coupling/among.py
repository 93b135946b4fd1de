"""A coupling in a cell that has only some of the arms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from duocell.models.cell.coupling.coupling import Coupling


def among(coupling: Coupling, arms: Sequence[int]) -> Coupling | None:
    """The coupling with the numbers that its arms have among some of a cell's arms; None if one of them is missing.

    Args:
        coupling: any.
        arms: indices of the arms that are there.
    """
    if not set(coupling.arms) <= set(arms):
        return None
    numbers = tuple(list(arms).index(arm) for arm in coupling.arms)
    return replace(coupling, arms=numbers)
