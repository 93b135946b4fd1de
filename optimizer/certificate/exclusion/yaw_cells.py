r"""Yaws in cells: which of them a base may still take, and what those cost that are left.

A yaw shifts joint 1 of all poses by the same s. Over a box let r bound the change of joint 1 at every pose. Given p and
a turn k of 2π, the allowed shifts are an interval K(p), and the cost is a parabola ``w_1 W (s - s*(p))²`` over it plus
what does not depend on s; s*(p), and the ends of K(p), move by no more than r, and so does ``proj = clip(s*, K)``. As a
parabola grows at least as the square of the distance from its minimum on an interval,

    E(p, s) >= min over yaws E(p, ·) + w_1 W (s - proj(p))² >= G + w_1 W (|s - proj(c)| - r)₊²,

with G any bound of the box that knows of no yaw that is lost. A bounded yaw leaves several turns, and the one that s is
on may be far worse than the best: with s* the vertex of the parabola and D₀ >= dist(s*(p), K(p)) over the box, what
does not depend on s costs at least G - w_1 W D₀², so that E(p, s) >= G + w_1 W ((|s - s*(c)| - r)₊² - D₀²) as well.
(From a bound that has been raised in this way already the same cost would be counted twice.) The new bound is the
smallest over the cells of yaws that are left. It needs a path that is linked from pose to pose, one segment, and a
weight on joint 1; else yaws can only be lost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.rules import MISSED, Rules
from duocell.optimizer.certificate.bounds.yaw import unwrapped

CELLS = 24
"""Cells of yaws of a box."""
WIDEST = 3.0
"""rad; a box over which joint 1 changes by more says nothing about the yaw that is best."""
TURNS = range(-2, 3)
"""Turns of 2π that joint 1 can take besides the yaw."""


@dataclass(frozen=True, eq=False, slots=True)
class YawCells:
    """The yaws of N boxes in n cells.

    Attributes:
        shift: (N, n) rad that joint 1 is shifted by in the middle of each cell. half: (N,) rad, half the width.
        cost: (N, n) at least added to the bound of the box by a yaw in the cell; inf where there is none.
        outside: (N,) at least added by a yaw in none of the cells; inf where there is none.
    """

    shift: Floats
    half: Floats
    cost: Floats
    outside: Floats

    def least(self, live: Bools) -> Floats:
        """(N,) at least added, if only some cells (N, n) are left; inf where none is."""
        inside = np.min(np.where(live, self.cost, np.inf), axis=1)
        return np.asarray(np.minimum(inside, self.outside))


def yaw_cells(first: Ball, rules: Rules, room: Floats) -> YawCells:
    """Cut the yaws of boxes into cells.

    Args:
        first: (N, m) rad, joint 1 at yaw 0. rules: of the arm.
        room: (N,) cost above the bounds of the boxes from which on yaws are of no interest.
    """
    path, linked = unwrapped(first, rules.max_step, rules.joined)
    radius = np.max(path.radius, axis=1)
    weight = rules.weights[0] * (path.centre.shape[1] if rules.counts is None else float(np.sum(rules.counts)))
    known = np.all(linked, axis=1) & (radius < WIDEST) & (len(rules.segments) == 1) & (weight > 0.0)
    wanted = rules.reference[0] - _mean(path.centre, rules.counts)
    low, high = rules.lower[0] - np.min(path.centre, axis=1), rules.upper[0] - np.max(path.centre, axis=1)
    offsets = (2.0 * np.arange(CELLS) + 1.0) / CELLS - 1.0
    if rules.shifts.free:
        best = _projected(wanted, low, high)
        with np.errstate(invalid="ignore"):
            wide = radius + np.sqrt(np.maximum(room, 0.0) / max(weight, 1e-300))
        window = np.where(known, np.minimum(wide, np.pi), np.pi)
        shift = np.where(known, best, 0.0)[:, None] + window[:, None] * offsets
        half = window / CELLS
        cost = weight * np.maximum(np.abs(shift - best[:, None]) - (half + radius)[:, None], 0.0) ** 2
        outside = np.where(known & (window < np.pi), np.maximum(room, 0.0), np.inf)
    else:
        shift = np.broadcast_to(rules.shifts.start + 0.5 * rules.shifts.width * (1.0 + offsets), (len(radius), CELLS))
        half = np.full(len(radius), 0.5 * rules.shifts.width / CELLS)
        cost = weight * _nearest_turn(shift, half, radius, wanted, (low, high), rules)
        outside = np.full(len(radius), np.inf)
    return YawCells(shift, half, np.where(known[:, None], cost, 0.0), outside)


def _nearest_turn(
    shift: Floats, half: Floats, radius: Floats, wanted: Floats, ends: tuple[Floats, Floats], rules: Rules
) -> Floats:
    """(N, n) rad², what cells of a bounded yaw cost at least on the turn that suits them best, per w_1 W."""
    intervals = allowed_shifts(ends, rules)
    least = least_turn(wanted, radius, intervals)
    cost = np.full(shift.shape, np.inf)
    for turn, (low, high) in zip(TURNS, intervals, strict=True):
        best = _projected(wanted, low, high)
        there = low <= high + 2.0 * radius
        here, about = shift + TURN * turn, (half + radius)[:, None]
        square = np.maximum(np.abs(here - best[:, None]) - about, 0.0) ** 2
        far = np.maximum(np.abs(here - wanted[:, None]) - about, 0.0) ** 2 - least[:, None] ** 2
        cost = np.minimum(cost, np.where(there[:, None], np.maximum(square, far), np.inf))
    return cost


def allowed_shifts(ends: tuple[Floats, Floats], rules: Rules) -> list[tuple[Floats, Floats]]:
    """[(N,), (N,)] rad, the shifts of a bounded yaw on each turn, between the ends that limits of joint 1 leave."""
    starts = [rules.shifts.start + TURN * turn for turn in TURNS]
    return [(np.maximum(ends[0], start), np.minimum(ends[1], start + rules.shifts.width)) for start in starts]


def least_turn(wanted: Floats, radius: Floats, intervals: list[tuple[Floats, Floats]]) -> Floats:
    """(N,) rad; everywhere in a box some allowed shift is no farther than this from the best one of all; or inf."""
    least = np.full(len(wanted), np.inf)
    for low, high in intervals:
        turn = np.abs(wanted - _projected(wanted, low, high)) + 2.0 * radius + 4.0 * MISSED
        least = np.minimum(least, np.where(low + 2.0 * radius <= high, turn, np.inf))
    return least


def _projected(wanted: Floats, low: Floats, high: Floats) -> Floats:
    """(N,) the point of intervals nearest to ``wanted``; the middle of what an interval lacks where it is empty."""
    fine = low <= high
    with np.errstate(invalid="ignore"):
        return np.where(fine, np.clip(wanted, low, np.maximum(low, high)), 0.5 * (low + high))


def _mean(path: Floats, counts: Floats | None) -> Floats:
    if counts is None or not np.any(counts):
        return np.asarray(np.mean(path, axis=1))
    return np.asarray(path @ counts / np.sum(counts))
