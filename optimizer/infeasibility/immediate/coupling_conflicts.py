"""Couplings that contradict each other or the base regions, before anything is known of the arms.

All rows that are linear in the positions of the bases (one height, rails, directions, mirrored positions), the largest
distances as polygons around their discs, and least distances in a direction that is given are one linear program: how
much would all of them have to be loosened to be kept from inside the boxes of the bases? Where the answer is more than
nothing, they cannot be kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, cos, floor, inf, isfinite, pi, sin

import numpy as np
from scipy.optimize import linprog

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror
from duocell.models.cell.coupling.apart import Apart
from duocell.models.robot.arm import TURN
from duocell.optimizer.infeasibility.immediate.cause import SURE, Infeasibility
from duocell.optimizer.infeasibility.immediate.distance_conflicts import distance_conflicts
from duocell.optimizer.reduction.box import search_box

SIDES = 32
"""Of the polygon around a disc."""


def coupling_conflicts(cell: Cell) -> tuple[Infeasibility, ...]:
    """Couplings that no bases keep; those that fail by themselves first."""
    if not cell.couplings:
        return ()
    found = distance_conflicts(cell)
    if found:
        return tuple(found)
    for boxes in (_regions(cell), _within_reach(cell)):
        if boxes is None:
            continue
        found = [
            cause
            for k, coupling in enumerate(cell.couplings)
            for cause in (*_distances(cell, k, coupling, boxes), *_mirrored_yaw(cell, k, coupling))
        ]
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


def _distances(cell: Cell, k: int, coupling: Coupling, boxes: Floats) -> list[Infeasibility]:
    """A distance that the boxes of two bases do not allow."""
    if not isinstance(coupling, Distance):
        return []
    first, second = (boxes[arm, :2] for arm in coupling.arms)
    apart = np.maximum(np.maximum(second[:, 0] - first[:, 1], first[:, 0] - second[:, 1]), 0.0)
    across = np.maximum(second[:, 1] - first[:, 0], first[:, 1] - second[:, 0])
    least, most = float(np.hypot(*apart)), float(np.hypot(*across))
    names = " and ".join(cell.arms[arm].name for arm in coupling.arms)
    if coupling.minimum > most + KEPT + SURE:
        wanted, possible, field, side = coupling.minimum, floor(1e3 * most) / 1e3, "minimum", "at most"
    elif coupling.maximum < least - KEPT - SURE:
        wanted, possible, field, side = coupling.maximum, ceil(1e3 * least) / 1e3, "maximum", "at least"
    else:
        return []
    detail = (
        f"{names}: coupling distance asks for a {field} of {wanted:g} m, but their bases stand {side} {possible:g} m "
        f"apart: ask for {possible:g} m, or change the base regions by {abs(wanted - possible):.3f} m"
    )
    pointer = f"/coupling/{k}/{field}"
    return [
        Infeasibility(
            kind="coupling",
            detail=detail,
            arms=coupling.arms,
            required=wanted,
            possible=possible,
            missing=abs(wanted - possible),
            pointer=pointer,
            unit="m",
        )
    ]


def _mirrored_yaw(cell: Cell, k: int, coupling: Coupling) -> list[Infeasibility]:
    """Yaws whose intervals leave no mirrored pair: yaw1 + yaw2 = 2 angle, modulo a turn."""
    if not isinstance(coupling, Mirror):
        return []
    first, second = (cell.arms[arm].base for arm in coupling.arms)
    if first.yaw_free or second.yaw_free:
        return []
    low, high = first.yaw.low + second.yaw.low, first.yaw.high + second.yaw.high
    wanted = 2.0 * coupling.angle
    turned = wanted + TURN * ceil((low - wanted) / TURN - 1e-12)
    violation = min(turned - high, low - (turned - TURN))
    if violation <= 2.0 * KEPT + SURE:
        return []
    names = " and ".join(cell.arms[arm].name for arm in coupling.arms)
    detail = (
        f"{names}: coupling mirror ties their yaws, whose intervals leave no mirrored pair: widen them by "
        f"{violation:.4f} rad together, or turn the mirror by {0.5 * violation:.4f} rad"
    )
    pointer = f"/coupling/{k}/angle"
    return [Infeasibility("coupling", detail, coupling.arms, missing=violation, pointer=pointer, unit="rad")]


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
    for coupling in couplings:
        if isinstance(coupling, Distance):
            for angle in np.arange(SIDES) * (2.0 * pi / SIDES) if isfinite(coupling.maximum) else ():
                row = np.zeros((arms, 3))
                row[coupling.arms[1], :2] = cos(angle), sin(angle)
                row[coupling.arms[0], :2] = -row[coupling.arms[1], :2]
                rows.append(row.ravel())
                highs.append(coupling.maximum)
            for angle in _directions(coupling, couplings):
                row = np.zeros((arms, 3))
                row[coupling.arms[0], :2] = cos(angle), sin(angle)
                row[coupling.arms[1], :2] = -row[coupling.arms[0], :2]
                rows.append(row.ravel())
                highs.append(-max(coupling.minimum - KEPT, 0.0))
            continue
        if isinstance(coupling, Apart):  # in all directions alike
            continue
        start = coupling.rows([np.zeros(4)] * arms)
        slopes = np.array([_slopes(coupling, arms, index, start.values) for index in range(3 * arms)])
        for r, (value, low, high, label) in enumerate(
            zip(start.values, start.lower, start.upper, start.labels, strict=True)
        ):
            if label == "mirrored yaw":
                continue
            if isfinite(high):
                rows.append(slopes[:, r])
                highs.append(high - float(value))
            if isfinite(low):
                rows.append(-slopes[:, r])
                highs.append(float(value) - low)
    return np.array(rows).reshape(-1, 3 * arms), np.array(highs)


def _directions(distance: Distance, couplings: Sequence[Coupling]) -> list[float]:
    """rad, in which the second base of a distance lies from the first: what lies along it is then all of the distance.

    It may be off by `KEPT` to the side, which shortens it by less.
    """
    first, second = distance.arms
    directions = [coupling for coupling in couplings if isinstance(coupling, Direction)]
    return [direction.angle for direction in directions if direction.arms == (first, second)] + [
        direction.angle + pi for direction in directions if direction.arms == (second, first)
    ]


def _slopes(coupling: Coupling, arms: int, index: int, start: Sequence[float]) -> list[float]:
    """Change of every row by one coordinate: exact, for the rows are linear."""
    bases = np.zeros((arms, 4))
    bases[index // 3, index % 3] = 1.0
    values = coupling.rows(list(bases)).values
    return [float(value) - float(before) for value, before in zip(values, start, strict=True)]
