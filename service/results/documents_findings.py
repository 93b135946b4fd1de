"""What is found out about a layout in a real cell, as parts of the JSON document of the contract."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.results.findings import Clearance, Explanation, Tolerance
from duocell.service.common.numbers import finite


def clearances_document(clearances: Iterable[Clearance]) -> dict[str, Any]:
    """Every class by its word; null for those that were not looked at."""
    found = {clearance.kind: _clearance(clearance) for clearance in clearances}
    return {kind.value: found.get(kind.value) for kind in PairClass}


def _clearance(clearance: Clearance) -> dict[str, Any]:
    return {
        "required": clearance.required,
        "distance": finite(clearance.distance),
        "pair": [clearance.first, clearance.second],
        "pose": clearance.pose,
        "fraction": clearance.fraction,
        "lower_bound": finite(clearance.lower_bound),
        "certain": clearance.certain,
    }


def tolerance_document(tolerance: Tolerance | None) -> dict[str, Any] | None:
    """What installation errors leave."""
    if tolerance is None:
        return None
    return {
        "position": tolerance.position,
        "angle": tolerance.angle,
        "samples": tolerance.samples,
        "feasible": tolerance.feasible,
        "margin": finite(tolerance.margin),
        "margin_by_sensitivity": finite(tolerance.margin_by_sensitivity),
        "clearances": {kind.value: finite(tolerance.clearances.get(kind.value)) for kind in PairClass},
        "largest": finite(tolerance.largest),
        "note": tolerance.note,
    }


def explanation_document(explanation: Explanation | None) -> dict[str, Any] | None:
    """What blocks an infeasible cell."""
    if explanation is None:
        return None
    return {
        "blocking": list(explanation.blocking),
        "irreducible": explanation.irreducible,
        "relaxations": [
            {"what": change.what, "pointer": change.pointer, "objective": finite(change.objective)}
            for change in explanation.relaxations
        ],
        "behind": list(explanation.behind),
    }
