r"""What it costs two arms that a direction from base to base says how the bases are turned.

Where couplings give the direction from one base to the other as seen from a base (`Bearing`), the places of both decide
its yaw: over a pair of boxes it lies within h of some angle. By the bound of other yaws than the best in a box,
``E(p, yaw) >= G + V (|yaw - yaw*| - r)₊² - V D₀²`` (`mirrored_yaw`), an arm whose best yaw is D off that angle costs at
least ``V (D - h - r)₊² - V D₀²`` more. Both arms may be told their yaws this way; what they cost adds up.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.coupling.relations import Bearing
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE
from duocell.optimizer.certificate.pairs.mirrored_yaw import BestYaw

NEAR = 1e-3
"""m; nearer boxes lie in no direction from each other."""


def bearing_cost(
    couplings: tuple[Coupling, ...], arms: tuple[int, int], boxes: tuple[Boxes, Boxes], yaws: tuple[BestYaw, BestYaw]
) -> Floats:
    """(P,) what yaws that follow from the places add at least to the bounds of pairs of boxes.

    Args:
        couplings: of the cell. arms: indices of the two.
        boxes: of both (P,). yaws: the best ones over them.
    """
    added = np.zeros((2, len(boxes[0])))
    relations = (each for coupling in couplings for each in coupling.relations())
    told = [each for each in relations if isinstance(each, Bearing) and set(each.arms) == set(arms)]
    if any(bearing.axis in arms for bearing in told):
        angle, half, near = _directions(*boxes)
        for bearing in told:
            if bearing.axis in arms:
                which = arms.index(bearing.axis)
                best = yaws[which]
                turned = 0.0 if bearing.arms[0] == arms[0] else 0.5 * TURN
                off = best.yaw - (angle + turned - 0.5 * (bearing.low + bearing.high))
                spread = half + 0.5 * (bearing.high - bearing.low) + TOLERANCE * (1.0 + 1.0 / near)
                off = np.abs(off - TURN * np.round(off / TURN)) - spread - best.radius
                cost = best.weight * np.maximum(off, 0.0) ** 2 - best.paid
                added[which] = np.maximum(added[which], cost)
    return np.asarray(np.sum(added, axis=0))


def _directions(first: Boxes, second: Boxes) -> tuple[Floats, Floats, Floats]:
    """(P,) rad from bases in one box to bases in another, rad by how much that may be off, and m between them."""
    apart, reach = second.centre - first.centre, first.half + second.half
    size, spread = (np.linalg.norm(part[:, :2], axis=1) for part in (apart, reach))
    known = size - spread > NEAR
    half = np.arcsin(np.where(known, spread, 0.0) / np.where(known, size, 1.0))
    angle = np.arctan2(apart[:, 1], apart[:, 0])
    return angle, np.where(known, half, np.inf), np.where(known, size - spread, 1.0)
