"""Base regions, or couplings, that leave two arms in one place."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling.relations import Separation
from duocell.models.cell.one_place import NEAREST, one_machine
from duocell.optimizer.infeasibility.immediate.cause import SURE, Infeasibility, millimetres


def one_place_conflicts(cell: Cell) -> tuple[Infeasibility, ...]:
    """Pairs of arms whose bases are too near to each other wherever they stand in their regions."""
    found = []
    for first, second in combinations(range(len(cell.arms)), 2):
        one, other = cell.arms[first], cell.arms[second]
        low, high = (np.array([arm.base.bounds[:3, side] for arm in (one, other)]) for side in (0, 1))
        most = float(np.linalg.norm(np.maximum(high[1] - low[0], high[0] - low[1])))
        if most < NEAREST - KEPT - SURE and not one_machine(one, other):
            detail = (
                f"{one.name} and {other.name} would stand in one place: their base regions leave {millimetres(most)} "
                f"between them, and two bases need {millimetres(NEAREST)} at least; move or widen a region"
            )
            found.append(
                Infeasibility("collision", detail, (first, second), missing=NEAREST - most, pointer="/arms", unit="m")
            )
    return (*found, *_tied(cell))


def _tied(cell: Cell) -> list[Infeasibility]:
    """Couplings that hold two bases too near to each other."""
    found = []
    for k, coupling in enumerate(cell.couplings):
        for relation in coupling.relations():
            if not isinstance(relation, Separation) or relation.level:
                continue
            one, other = (cell.arms[arm] for arm in relation.arms)
            if relation.maximum < NEAREST - KEPT - SURE and not one_machine(one, other):
                detail = (
                    f"{one.name} and {other.name} would stand in one place: coupling {coupling.kind} leaves "
                    f"{millimetres(relation.maximum)} between their bases, and two need {millimetres(NEAREST)} at "
                    "least; move them farther apart"
                )
                missing, pointer = NEAREST - relation.maximum, f"/coupling/{k}"
                found.append(
                    Infeasibility("coupling", detail, relation.arms, missing=missing, pointer=pointer, unit="m")
                )
    return found
