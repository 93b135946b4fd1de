"""Couplings over pairs of boxes of base positions: which pairs hold no two bases that keep them all."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.coupling.relations import Linear, Separation, linear_between
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE


def untied(couplings: tuple[Coupling, ...], arms: tuple[int, int], first: Boxes, second: Boxes) -> Bools:
    """(P,) True where no two bases in boxes (P,) keep a coupling.

    Args:
        couplings: of the cell; those that do not hold for both arms are passed over.
        arms: indices of the two. first: boxes of the one. second: of the other.
    """
    lost: Bools = np.zeros(len(first), dtype=np.bool_)
    boxes = {arms[0]: first, arms[1]: second}
    for coupling in couplings:
        relations = coupling.relations()
        for row in linear_between(relations, *arms):
            lost |= _off(row, boxes)
        for relation in relations:
            if isinstance(relation, Separation) and set(relation.arms) == set(arms):
                lost |= _too_near_or_far(relation, second.centre - first.centre, first.half + second.half)
    return lost


def _off(row: Linear, boxes: dict[int, Boxes]) -> Bools:
    """(P,) True where a row is kept nowhere in the boxes of its arms."""
    value = sum(boxes[arm].centre @ np.array(direction) for arm, direction in row.terms)
    spread = sum(boxes[arm].half @ np.abs(direction) for arm, direction in row.terms)
    return np.asarray((value - spread > row.high + TOLERANCE) | (value + spread < row.low - TOLERANCE))


def _too_near_or_far(separation: Separation, apart: Floats, reach: Floats) -> Bools:
    """(P,) True where no two points that are (P, 3) m apart, give or take (P, 3) m, have a distance."""
    axes = 2 if separation.level else 3
    size, spread = np.abs(apart[:, :axes]), reach[:, :axes]
    near = np.linalg.norm(np.maximum(size - spread, 0.0), axis=1)
    far = np.linalg.norm(size + spread, axis=1)
    return np.asarray((near > separation.maximum + TOLERANCE) | (far < separation.minimum - TOLERANCE))
