r"""What it costs two arms that their yaws are mirror images.

Over a box, ``E(p, yaw) >= G + V (|yaw - yaw*| - r)₊²`` with V = w_1 W, yaw* the best yaw at its centre and r the
change of joint 1 (`exclusion.yaw_cells`). Mirrored yaws have ``yaw_1 + yaw_2 = 2 angle`` (modulo 2π), so that together
they are off by at least ``D = (|yaw_1* + yaw_2* - 2 angle| - r_1 - r_2)₊``, and the cheapest way to share D costs
``D² V_1 V_2 / (V_1 + V_2)``. That is added to the bounds that know of no yaw that is lost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arm import TURN
from models.arrays import Floats, Ints
from models.coupling import Coupling, Mirror
from optimizer.certificate.bounds.ball import Ball
from optimizer.certificate.bounds.rules import Rules
from optimizer.certificate.bounds.yaw import unwrapped


@dataclass(frozen=True, eq=False, slots=True)
class BestYaw:
    """The best yaws of N boxes: ``yaw`` (N,) rad, ``radius`` (N,) rad (inf where unknown), ``price`` V of a rad²."""

    yaw: Floats
    radius: Floats
    price: float

    def __getitem__(self, rows: Ints) -> BestYaw:
        return BestYaw(self.yaw[rows], self.radius[rows], self.price)


def best_yaw(first: Ball, rules: Rules, sigma: int) -> BestYaw:
    """The best yaws over boxes.

    Args:
        first: (N, m) rad, joint 1 at yaw 0. rules: of the arm. sigma: sense of joint 1 about the base's z axis.
    """
    path, linked = unwrapped(first, rules.max_step, rules.joined)
    counts = np.ones(path.centre.shape[1]) if rules.counts is None else rules.counts
    total = float(np.sum(counts))
    radius = np.max(path.radius, axis=1)
    known = np.all(linked, axis=1) & rules.shifts.free & (len(rules.jobs) == 1) & (total > 0.0)
    wanted = rules.reference[0] - path.centre @ counts / (total or 1.0)
    low, high = rules.lower[0] - np.min(path.centre, axis=1), rules.upper[0] - np.max(path.centre, axis=1)
    shift = np.where(low <= high, np.clip(wanted, low, np.maximum(low, high)), wanted)
    known &= low <= high
    return BestYaw(-sigma * shift, np.where(known, radius, np.inf), float(rules.weights[0]) * total)


def mirrored_cost(couplings: tuple[Coupling, ...], arms: tuple[int, int], first: BestYaw, second: BestYaw) -> Floats:
    """(P,) what mirrored yaws add at least to the bounds of pairs of boxes."""
    added: Floats = np.zeros(len(first.yaw))
    both = first.price + second.price
    for coupling in couplings:
        if isinstance(coupling, Mirror) and set(arms) == set(coupling.arms) and both > 0.0:
            off = first.yaw + second.yaw - 2.0 * coupling.angle
            off = np.abs(off - TURN * np.round(off / TURN)) - first.radius - second.radius
            added = np.maximum(added, np.maximum(off, 0.0) ** 2 * first.price * second.price / both)
    return added
