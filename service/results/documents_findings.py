"""What is found out about a layout in a real cell, as parts of the JSON document of the contract."""

from __future__ import annotations

from collections.abc import Iterable

from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.results.findings import Clearance, Tolerance
from duocell.service.schemas.findings import ClassClearance, Clearances, ToleranceResult


def clearances(kept: Iterable[Clearance]) -> Clearances:
    """Every class by its word; null for those that were not looked at."""
    found = {one.kind: ClassClearance.of(one, pair=[one.first, one.second]) for one in kept}
    return Clearances.model_validate({kind.value: found.get(kind.value) for kind in PairClass})


def tolerance(left: Tolerance) -> ToleranceResult:
    """What installation errors leave."""
    return ToleranceResult.of(left, clearances={kind.value: left.clearances.get(kind.value) for kind in PairClass})
