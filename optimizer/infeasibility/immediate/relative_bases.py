"""Two bases that would have to stand in each other, or apart and near at once: boxes of their relative position alone.

What couplings ask of two bases depends mostly on where the second stands as seen from the first. Balls about points of
both yaw axes lie inside the base bodies at every yaw, so their distance is at least as large as that of the bodies.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import inf

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.kept import KEPT
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling.relations import Bearing, Separation, across, along, linear_between
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Sphere
from duocell.models.kinematics.chain import chain_of
from duocell.models.robot.arm import TURN
from duocell.optimizer.infeasibility.immediate.cause import SURE, Infeasibility, millimetres, rounded_down
from duocell.optimizer.reduction.box import search_box

MOST, SMALLEST = 3000, 2e-3
"""Boxes, and m, half side of the smallest."""
HALVINGS = 12
"""Of a clearance."""
LEVELS = 9
"""Points of a yaw axis per body."""


@dataclass(frozen=True, eq=False, slots=True)
class _Ties:
    """What is asked of the relative position d = p2 - p1 [m].

    Attributes:
        rows: (K, 3). low: (K,) m. high: (K,): ``low <= rows d <= high``.
        least: m, of the horizontal distance. most: m.
    """

    rows: Floats
    low: Floats
    high: Floats
    least: float
    most: float


@dataclass(frozen=True, eq=False, slots=True)
class _Balls:
    """Balls on the yaw axis: centres (k, 3) m relative to the base origin, radii (k,) m."""

    centres: Floats
    radii: Floats


def relative_base_conflicts(cell: Cell, model: CollisionModel | None) -> tuple[Infeasibility, ...]:
    """Pairs of arms whose bases cannot both stand anywhere, for their couplings and their bodies alone."""
    boxes = [search_box(cell, arm) for arm in cell.arms]
    if any(np.any(box[:, 0] > box[:, 1]) for box in boxes):
        return ()
    required = cell.surroundings.clearances.arm_arm
    balls = [_balls(cell, model, a) if model is not None and required is not None else None for a in range(len(boxes))]
    found = []
    for first, second in combinations(range(len(cell.arms)), 2):
        root = np.stack([boxes[second][:, 0] - boxes[first][:, 1], boxes[second][:, 1] - boxes[first][:, 0]], axis=-1)
        ties = _ties(cell, first, second, float(np.linalg.norm(np.max(np.abs(root[:2]), axis=1))))
        if _empty(root, ties, None, 0.0):
            found.append(_contradiction(cell, first, second))
            continue
        one, other = balls[first], balls[second]
        if one is None or other is None or required is None or not (len(one.radii) and len(other.radii)):
            continue
        pair = _Balls(
            (other.centres[None] - one.centres[:, None]).reshape(-1, 3), np.add.outer(one.radii, other.radii).ravel()
        )
        if _empty(root, ties, pair, required):
            found.append(_in_each_other(cell, (first, second), root, ties, pair, required))
    return tuple(found)


def _ties(cell: Cell, first: int, second: int, far: float) -> _Ties:
    """What the couplings of two arms ask of their relative position.

    Args:
        cell: the cell. first: number of one arm. second: of the other.
        far: m, how far apart they are at most.
    """
    rows: list[tuple[Floats, float, float]] = []
    least, most = 0.0, inf
    for coupling in cell.couplings:
        relations = coupling.relations()
        for row in linear_between(relations, first, second):
            slopes = {arm: np.array(way) for arm, way in row.terms}
            if len(slopes) == 2 and np.array_equal(slopes[first], -slopes[second]):
                rows.append((slopes[second], row.low, row.high))
        for relation in relations:
            if isinstance(relation, Separation) and relation.level and set(relation.arms) == {first, second}:
                least, most = max(least, relation.minimum), min(most, relation.maximum)
            elif isinstance(relation, Bearing) and set(relation.arms) == {first, second}:
                rows += _sector(cell, relation, 1.0 if relation.arms[0] == first else -1.0, far)
    matrix = np.array([row for row, _, _ in rows]).reshape(-1, 3)
    return _Ties(matrix, np.array([low for _, low, _ in rows]), np.array([high for _, _, high in rows]), least, most)


def _sector(cell: Cell, bearing: Bearing, sense: float, far: float) -> list[tuple[Floats, float, float]]:
    """Rows of a direction that counts from a yaw which is bounded; scaled, so that a slack [m] is one of angles.

    Directions from the world's axis have rows of their own.
    """
    if bearing.axis is None or cell.arms[bearing.axis].base.yaw_free:
        return []
    yaw = cell.arms[bearing.axis].base.yaw
    low, high = yaw.low + bearing.low, yaw.high + bearing.high
    scale = sense / max(far, 1.0)
    left_of_low, left_of_high = scale * np.array(across(low)), scale * np.array(across(high))
    if low == high:
        return [(left_of_low, 0.0, 0.0), (scale * np.array(along(low)), 0.0, inf)]
    return [(left_of_low, 0.0, inf), (left_of_high, -inf, 0.0)] if high - low < 0.5 * TURN else []


def _balls(cell: Cell, model: CollisionModel, a: int) -> _Balls:
    """Balls inside the bodies of an arm's base, and of its first link where that turns about the yaw axis."""
    arm, b = cell.arms[a], model.bodies
    first = arm.robot.joint_placements[0]
    links = {0: np.eye(4)} | ({1: first} if chain_of(arm.robot).vertical_sign else {})
    speck, centres, radii = Sphere(1e-6), [], []
    for i, owner in enumerate(b.owners):
        if owner.arm != a or owner.link not in links or b.flat[i]:
            continue
        body, pose = b.sure[i], links[owner.link] @ b.sure[i].pose
        middle, reach = pose @ np.append(np.zeros(3), 1.0), float(np.linalg.norm(b.half[i]))
        for z in np.linspace(middle[2] - reach, middle[2] + reach, LEVELS):
            depth = -separation(speck, transform(np.eye(3), [0.0, 0.0, z]), body.shape, pose).distance - 1e-6
            if depth > 0.0:
                centres.append(z * arm.mount[:, 2])
                radii.append(depth)
    return _Balls(np.array(centres).reshape(-1, 3), np.array(radii, dtype=np.float64))


def _empty(root: Floats, ties: _Ties, balls: _Balls | None, required: float) -> bool:
    """True if no relative position in a box (3, 2) m keeps the ties and the distance of the balls."""
    centre, half = 0.5 * np.sum(root, axis=1)[None], 0.5 * (root[:, 1] - root[:, 0])[None]
    looked_at = 0
    while looked_at < MOST:
        looked_at += len(centre)
        left = ~_excluded(centre, half, ties, balls, required)
        centre, half = centre[left], half[left]
        if not len(centre):
            return True
        if np.max(half) < SMALLEST or _some_kept(root, centre, ties, balls, required):
            return False
        widest = np.argmax(half, axis=1)
        half = half.copy()
        half[np.arange(len(half)), widest] *= 0.5
        shift = np.zeros_like(half)
        shift[np.arange(len(half)), widest] = half[np.arange(len(half)), widest]
        centre, half = np.vstack([centre - shift, centre + shift]), np.vstack([half, half])
    return False


def _excluded(centre: Floats, half: Floats, ties: _Ties, balls: _Balls | None, required: float) -> Bools:
    """(N,) True for boxes in which no position keeps everything."""
    slack = KEPT + SURE
    values, reach = centre @ ties.rows.T, half @ np.abs(ties.rows).T
    gone: Bools = np.any((values - reach > ties.high + slack) | (values + reach < ties.low - slack), axis=1)
    nearest = np.linalg.norm(np.maximum(np.abs(centre[:, :2]) - half[:, :2], 0.0), axis=1)
    farthest = np.linalg.norm(np.abs(centre[:, :2]) + half[:, :2], axis=1)
    gone |= (nearest > ties.most + slack) | (farthest < ties.least - slack)
    if balls is not None:
        apart = np.linalg.norm(np.abs(centre[:, None] + balls.centres) + half[:, None], axis=2)
        gone |= np.any(apart - balls.radii < required - slack, axis=1)
    return gone


def _some_kept(root: Floats, centre: Floats, ties: _Ties, balls: _Balls | None, required: float) -> bool:
    """True if one of the centres, moved onto the equations, keeps everything: then there is nothing to prove."""
    equal = ties.low == ties.high
    rows = ties.rows[equal]
    moved = centre - (centre @ rows.T - ties.low[equal]) @ np.linalg.pinv(rows).T if len(rows) else centre
    inside = np.all((moved >= root[:, 0]) & (moved <= root[:, 1]), axis=1)
    return bool(np.any(inside & ~_excluded(moved, np.zeros_like(moved), ties, balls, required)))


def _contradiction(cell: Cell, first: int, second: int) -> Infeasibility:
    concerned = [k for k, tie in enumerate(cell.couplings) if first in tie.arms and second in tie.arms]
    kinds = " and ".join(f"{cell.couplings[k].kind} (coupling {k})" for k in concerned)
    detail = (
        f"{cell.arms[first].name} and {cell.arms[second].name}: no two bases within their regions and the arms' reach "
        f"keep {kinds}; loosen or drop one, or widen the regions"
    )
    return Infeasibility("coupling", detail, (first, second), pointer=f"/coupling/{concerned[0]}", unit="m")


def _in_each_other(
    cell: Cell, arms: tuple[int, int], root: Floats, ties: _Ties, pair: _Balls, required: float
) -> Infeasibility:
    """In words, with the clearance that would be possible at most, or what is missing even to touch."""
    low, high = -float(np.max(pair.radii)), required
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _empty(root, ties, pair, middle) else (middle, high)
    possible = rounded_down(low) if low > 0.0 else None
    less = f"ask for at most {millimetres(possible)}, or " if possible is not None else ""
    concerned = [tie.kind for tie in cell.couplings if arms[0] in tie.arms and arms[1] in tie.arms]
    tied = f", loosen {' or '.join(dict.fromkeys(concerned))}" if concerned else ""
    names = " and ".join(cell.arms[a].name for a in arms)
    detail = (
        f"the bases of {names} have to stand in each other: wherever they may stand they lack at least "
        f"{millimetres(required - low)} of the {millimetres(required)} asked for: {less}let them stand so much farther "
        f"apart{tied}"
    )
    return Infeasibility(
        kind="collision",
        detail=detail,
        arms=arms,
        bodies=(f"base of {cell.arms[arms[0]].name}", f"base of {cell.arms[arms[1]].name}"),
        pair_class=PairClass.ARM_ARM,
        required=required,
        possible=possible,
        missing=required - low,
        pointer="/clearance/arm_arm",
        unit="m",
    )
