r"""What it costs two arms that their yaws are mirror images.

Over a box, ``E(p, yaw) >= G + V (|yaw - yaw*| - r)₊²`` with V = w_1 W, yaw* the best yaw at its centre and r the
change of joint 1 (`exclusion.yaw_cells`). Mirrored yaws have ``yaw_1 + yaw_2 = 2 angle`` (modulo 2π), so that together
they are off by at least ``D = (|yaw_1* + yaw_2* - 2 angle| - r_1 - r_2)₊``, and the cheapest way to share D costs
``D² V_1 V_2 / (V_1 + V_2)``. That is added to the bounds that know of no yaw that is lost.

A bounded yaw may have its vertex s* out of its interval K: then yaw* is that of s*, and what K costs already comes off,
``E(p, yaw) >= G + V ((|yaw - yaw*| - r)₊² - D₀²)`` with D₀ >= dist(s*, K) all over the box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.coupling import Coupling
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.certificate.bounds.yaw import unwrapped
from duocell.optimizer.certificate.exclusion.yaw_cells import allowed_shifts, least_turn
from duocell.optimizer.certificate.pairs.ties import mirrored_yaws


@dataclass(frozen=True, eq=False, slots=True)
class BestYaw:
    """The best yaws of N boxes.

    Attributes:
        yaw: (N,) rad. radius: (N,) rad, inf where unknown. weight: V of a rad².
        paid: (N,) part of what other yaws cost that the bounds of the boxes contain already, V D₀².
    """

    yaw: Floats
    radius: Floats
    weight: float
    paid: Floats

    def __getitem__(self, rows: Ints) -> BestYaw:
        return BestYaw(self.yaw[rows], self.radius[rows], self.weight, self.paid[rows])


def best_yaw(first: Ball, rules: Rules, sigma: int) -> BestYaw:
    """The best yaws over boxes.

    Args:
        first: (N, m) rad, joint 1 at yaw 0. rules: of the arm. sigma: sense of joint 1 about the base's z axis.
    """
    path, linked = unwrapped(first, rules.max_step, rules.joined)
    counts = np.ones(path.centre.shape[1]) if rules.counts is None else rules.counts
    total = float(np.sum(counts))
    radius = np.max(path.radius, axis=1)
    known = np.all(linked, axis=1) & (len(rules.segments) == 1) & (total > 0.0)
    weight = float(rules.weights[0]) * total
    wanted = rules.reference[0] - path.centre @ counts / (total or 1.0)
    low, high = rules.lower[0] - np.min(path.centre, axis=1), rules.upper[0] - np.max(path.centre, axis=1)
    if not rules.shifts.free:
        least = least_turn(wanted, radius, allowed_shifts((low, high), rules))
        known &= np.isfinite(least)
        paid = weight * np.where(known, least, 0.0) ** 2
        return BestYaw(-sigma * wanted, np.where(known, radius, np.inf), weight, paid)
    shift = np.where(low <= high, np.clip(wanted, low, np.maximum(low, high)), wanted)
    known &= low <= high
    return BestYaw(-sigma * shift, np.where(known, radius, np.inf), weight, np.zeros(len(radius)))


def mirrored_cost(couplings: tuple[Coupling, ...], arms: tuple[int, int], first: BestYaw, second: BestYaw) -> Floats:
    """(P,) what mirrored yaws add at least to the bounds of pairs of boxes."""
    added: Floats = np.zeros(len(first.yaw))
    both = first.weight + second.weight
    for total in mirrored_yaws(couplings, arms):
        if both > 0.0:
            off = first.yaw + second.yaw - total
            off = np.abs(off - TURN * np.round(off / TURN)) - first.radius - second.radius
            cost = np.maximum(off, 0.0) ** 2 * first.weight * second.weight / both
            added = np.maximum(added, cost - first.paid - second.paid)
    return added


def sum_of_yaws(total: float, first: BestYaw, second: BestYaw) -> tuple[Floats, Floats]:
    """The turn on which the best yaws of pairs of boxes nearly have a sum, and what any other turn costs at least.

    Args:
        total: rad, the sum modulo 2π. first: of the one arm. second: of the other.

    Returns:
        (P,) rad, the sum on that turn; (P,) cost beyond the bounds that know of no yaw that is lost, 0 where unknown.
    """
    off = first.yaw + second.yaw - total
    turn = TURN * np.round(off / TURN)
    apart = TURN - np.abs(off - turn) - first.radius - second.radius
    both = first.weight + second.weight
    cost = np.maximum(apart, 0.0) ** 2 * (first.weight * second.weight / both if both > 0.0 else 0.0)
    return total + turn, np.asarray(np.maximum(cost - first.paid - second.paid, 0.0))
