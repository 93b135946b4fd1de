"""Couplings that contradict each other or the base regions, before anything is known of the arms.

All rows that are linear in the positions of the bases (one height, rails, directions, mirrored positions), the largest
distances as polygons around their discs, and least distances in a direction that is given are one linear program: how
much would all of them have to be loosened to be kept from inside the boxes of the bases? Where the answer is more than
nothing, they cannot be kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from math import ceil, cos, floor, inf, isfinite, pi, sin

import numpy as np
from scipy.optimize import linprog

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.coupling.relations import Bearing, Separation, Yaws, linear_rows
from duocell.models.robot.arm import TURN
from duocell.optimizer.infeasibility.immediate.cause import SURE, Infeasibility
from duocell.optimizer.infeasibility.immediate.distance_conflicts import (
    distance_conflicts,
    field_of,
    level_distances,
)
from duocell.optimizer.reduction.box import search_box

SIDES = 32
"""Of the polygon around a disc."""


def coupling_conflicts(cell: Cell) -> tuple[Infeasibility, ...]:
    """Couplings that no bases keep; those that fail by themselves first."""
    if not cell.couplings:
        return ()
    found = [*distance_conflicts(cell), *_different_yaws(cell)]
    if found:
        return tuple(found)
    for boxes in (_regions(cell), _within_reach(cell)):
        if boxes is None:
            continue
        found = [cause for k, coupling in enumerate(cell.couplings) for cause in _alone(cell, k, coupling, boxes)]
        found = found or _together(cell, boxes)
        if found:
            break
    return tuple(found)


def _regions(cell: Cell) -> Floats:
    """(A, 3, 2) m, where bases may stand."""
    return np.array([arm.base.bounds[:3] for arm in cell.arms])


def _within_reach(cell: Cell) -> Floats | None:
    """(A, 3, 2) m, where they may stand and reach every pose; None where one of them has no such place."""
    boxes = np.array([search_box(cell, arm) for arm in cell.arms])
    return None if np.any(boxes[..., 0] > boxes[..., 1]) else boxes


def _alone(cell: Cell, k: int, coupling: Coupling, boxes: Floats) -> list[Infeasibility]:
    """What one coupling asks for and the bases do not allow."""
    found = [cause for distance in level_distances(coupling) for cause in _distance(cell, k, distance, boxes)]
    yaws = (each for each in coupling.relations() if isinstance(each, Yaws))
    return found + [cause for each in yaws for cause in _yaws(cell, k, each)]


def _distance(cell: Cell, k: int, asked: Separation, boxes: Floats) -> list[Infeasibility]:
    """A distance that the boxes of two bases do not allow."""
    first, second = (boxes[arm, :2] for arm in asked.arms)
    apart = np.maximum(np.maximum(second[:, 0] - first[:, 1], first[:, 0] - second[:, 1]), 0.0)
    across = np.maximum(second[:, 1] - first[:, 0], first[:, 1] - second[:, 0])
    least, most = float(np.hypot(*apart)), float(np.hypot(*across))
    names = " and ".join(cell.arms[arm].name for arm in asked.arms)
    if asked.minimum > most + KEPT + SURE:
        wanted, possible, end, side = asked.minimum, floor(1e3 * most) / 1e3, "minimum", "at most"
    elif asked.maximum < least - KEPT - SURE:
        wanted, possible, end, side = asked.maximum, ceil(1e3 * least) / 1e3, "maximum", "at least"
    else:
        return []
    kind = cell.couplings[k].kind
    detail = (
        f"{names}: coupling {kind} asks for a {end} of {wanted:g} m, but their bases stand {side} "
        f"{possible:g} m apart: ask for {possible:g} m, or change the base regions by {abs(wanted - possible):.3f} m"
    )
    pointer = field_of(k, asked.fields[end == "maximum"])
    return [
        Infeasibility(
            kind="coupling",
            detail=detail,
            arms=asked.arms,
            required=wanted,
            possible=possible,
            missing=abs(wanted - possible),
            pointer=pointer,
            unit="m",
        )
    ]


def _yaws(cell: Cell, k: int, asked: Yaws) -> list[Infeasibility]:
    """Yaws whose intervals leave no pair that keeps a coupling, modulo a turn."""
    first, second = (cell.arms[arm].base for arm in asked.arms)
    if first.yaw_free or second.yaw_free:
        return []
    ends = sorted((asked.sense * first.yaw.low, asked.sense * first.yaw.high))
    violation = _apart((ends[0] + second.yaw.low, ends[1] + second.yaw.high), (asked.low, asked.high))
    if violation <= 2.0 * KEPT + SURE:
        return []
    names = " and ".join(cell.arms[arm].name for arm in asked.arms)
    kept, remedy = asked.words
    detail = (
        f"{names}: coupling {cell.couplings[k].kind} ties their yaws, whose intervals leave no {kept}: widen them by "
        f"{violation:.4f} rad together, or {remedy} {asked.share * violation:.4f} rad"
    )
    pointer = field_of(k, asked.field)
    return [Infeasibility("coupling", detail, asked.arms, missing=violation, pointer=pointer, unit="rad")]


def _apart(given: tuple[float, float], asked: tuple[float, float]) -> float:
    """rad between two intervals of angles modulo a turn, the shorter way; negative where they overlap."""
    low = asked[0] + TURN * ceil((given[0] - asked[0]) / TURN - 1e-12)
    return min(low - given[1], given[0] - (low - TURN + asked[1] - asked[0]))


def _different_yaws(cell: Cell) -> list[Infeasibility]:
    """Two couplings that ask for different sums, or differences, of the same yaws."""
    asked = [
        (k, each)
        for k, coupling in enumerate(cell.couplings)
        for each in coupling.relations()
        if isinstance(each, Yaws)
    ]
    found = []
    for (k, one), (other_k, other) in combinations(asked, 2):
        if set(one.arms) != set(other.arms) or one.sense != other.sense:
            continue
        turned = one.sense < 0 and one.arms != other.arms
        wanted = (-other.high, -other.low) if turned else (other.low, other.high)
        violation = _apart((one.low, one.high), wanted)
        if violation <= 4.0 * KEPT + SURE:
            continue
        names = " and ".join(cell.arms[arm].name for arm in one.arms)
        kinds = " and ".join(f"{cell.couplings[i].kind} (coupling {i})" for i in (k, other_k))
        detail = f"{names}: {kinds} ask for yaws that are {violation:.4f} rad apart: change one by as much, or drop one"
        pointer = field_of(other_k, other.field)
        found.append(Infeasibility("coupling", detail, one.arms, missing=violation, pointer=pointer, unit="rad"))
    return found


def _together(cell: Cell, boxes: Floats) -> list[Infeasibility]:
    """Couplings that contradict each other inside the boxes: a set of which each is needed."""
    left = list(range(len(cell.couplings)))
    violation = _least_violation([cell.couplings[k] for k in left], boxes)
    if violation <= KEPT + SURE:
        return []
    for k in list(left):
        fewer = [other for other in left if other != k]
        smaller = _least_violation([cell.couplings[other] for other in fewer], boxes)
        if smaller > KEPT + SURE:
            left, violation = fewer, smaller
    arms = tuple(sorted({arm for k in left for arm in cell.couplings[k].arms}))
    names = " and ".join(cell.arms[arm].name for arm in arms)
    kinds = " and ".join(f"{cell.couplings[k].kind} (coupling {k})" for k in left)
    detail = (
        f"{names}: {kinds} cannot be kept from inside the base regions: each would have to give way by at least "
        f"{violation:.3f} m; drop one, or widen the regions"
    )
    return [Infeasibility("coupling", detail, arms, missing=violation, pointer=f"/coupling/{left[0]}", unit="m")]


def _least_violation(couplings: Sequence[Coupling], boxes: Floats) -> float:
    """m, how much all linear rows have to be loosened to be kept inside boxes (A, 3, 2); 0 where nothing is asked."""
    rows, highs = _linear(couplings, len(boxes))
    if not len(rows):
        return 0.0
    upper = np.column_stack([rows, -np.ones(len(rows))])
    bounds: list[tuple[float, float]] = [(float(low), float(high)) for low, high in boxes.reshape(-1, 2)]
    bounds.append((0.0, inf))
    cost = np.zeros(upper.shape[1])
    cost[-1] = 1.0
    found = linprog(cost, A_ub=upper, b_ub=highs, bounds=bounds, method="highs")
    return float(found.fun) if found.status == 0 and found.fun is not None else 0.0


def _linear(couplings: Sequence[Coupling], arms: int) -> tuple[Floats, Floats]:
    """Rows (K, 3 A) of the positions and their upper limits (K,)."""
    rows: list[Floats] = []
    highs: list[float] = []

    def add(terms: Iterable[tuple[int, Iterable[float]]], high: float) -> None:
        if isfinite(high):
            row = np.zeros((arms, 3))
            for arm, slope in terms:
                row[arm] = tuple(slope)
            rows.append(row.ravel())
            highs.append(high)

    for coupling in couplings:
        for each in linear_rows(coupling.relations()):
            add(each.terms, each.high)
            add([(arm, [-value for value in way]) for arm, way in each.terms], -each.low)
        for distance in level_distances(coupling):
            first, second = distance.arms
            for angle in np.arange(SIDES) * (2.0 * pi / SIDES):
                way = np.array([cos(angle), sin(angle), 0.0])
                add([(first, -way), (second, way)], distance.maximum)
            for angle in _directions(distance, couplings):
                way = np.array([cos(angle), sin(angle), 0.0])
                add([(first, way), (second, -way)], -max(distance.minimum - KEPT, 0.0))
    return np.array(rows).reshape(-1, 3 * arms), np.array(highs)


def _directions(distance: Separation, couplings: Sequence[Coupling]) -> list[float]:
    """rad, in which the second base of a distance lies from the first: what lies along it is then all of the distance.

    It may be off by `KEPT` to the side, which shortens it by less.
    """
    first, second = distance.arms
    directions = [
        each
        for coupling in couplings
        for each in coupling.relations()
        if isinstance(each, Bearing) and each.axis is None and each.low == each.high
    ]
    return [direction.low for direction in directions if direction.arms == (first, second)] + [
        direction.low + pi for direction in directions if direction.arms == (second, first)
    ]
