r"""Mirrored yaws in cells: what two arms cost at least, when each may have lost some of the yaws that are tied.

Yaws whose sum is given are one unknown. It is cut into cells, for all boxes the same; in a cell that both arms still
have, they cost at least ``V_1 (|u + t| - r_1)₊² + V_2 (|v - t| - r_2)₊²`` beyond their bounds, with u and v by how
much the middle of the cell misses the best yaws of both, and t within the cell (`mirrored_yaw`): convex in t, so the
least is where the whole line has it, or at the end of the cell nearest to that. The least cell that is left counts.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE
from duocell.optimizer.certificate.exclusion.yaw_cells import YawCells
from duocell.optimizer.certificate.pairs.mirrored_yaw import BestYaw
from duocell.optimizer.certificate.pairs.store import PairStore

CELLS = 96
"""Cells of the yaw that two arms share."""
HALF = 0.5 * TURN / CELLS
"""rad"""
MIDDLES = HALF * (2.0 * np.arange(CELLS) + 1.0)
"""(CELLS,) rad, yaws of the first arm in the middle of each cell."""


class SharedYaw:
    """The yaws that boxes of two arms have left, kept by their slots.

    Attributes:
        total: rad, sum of both yaws modulo 2π. stores: of the arms.
    """

    def __init__(self, total: float, stores: tuple[PairStore, PairStore]) -> None:
        self.total, self.stores = total, stores
        self._yaws = MIDDLES, total - MIDDLES
        self._live: tuple[dict[int, Bools], dict[int, Bools]] = ({}, {})

    def cost(self, first: Ints, second: Ints) -> Floats:
        """(P,) at least added to bounds of pairs of boxes that know of no yaw that is lost; inf if none is left."""
        live = self._left(0, first) & self._left(1, second)
        one, other = (store.yaw[store.places(ids)] for store, ids in zip(self.stores, (first, second), strict=True))
        cost = cell_costs(self._off(0, one), self._off(1, other), one, other)
        return np.asarray(np.min(np.where(live, cost, np.inf), axis=1))

    def _off(self, which: int, best: BestYaw) -> Floats:
        """(P, CELLS) rad, by how much the middles of the cells miss the best yaws."""
        off = self._yaws[which] - best.yaw[:, None]
        return np.asarray(off - TURN * np.round(off / TURN))

    def _left(self, which: int, ids: Ints) -> Bools:
        """(P, CELLS) False for cells in which the base of an arm surely hits something."""
        known, store = self._live[which], self.stores[which]
        new = np.array([i for i in np.unique(ids) if int(i) not in known], dtype=np.int64)
        if len(new):
            for node, live in zip(new, self._tested(which, store, new), strict=True):
                known[int(node)] = live
        return np.stack([known[int(i)] for i in ids])

    def _tested(self, which: int, store: PairStore, ids: Ints) -> Bools:
        excluder, problem = store.tree.excluder, store.tree.problem
        live = np.tile(self._allowed(which, store), (len(ids), 1))
        if not excluder.base.useful:
            return live
        slots = store.places(ids)
        assert store.motion is not None
        motion = store.motion[slots]
        shift = np.broadcast_to(-problem.sigma * self._yaws[which], live.shape)
        cells = YawCells(shift, np.full(len(ids), HALF + TOLERANCE), np.zeros(live.shape), np.full(len(ids), np.inf))
        return live & excluder.base.live(motion, cells, excluder.mounted(motion), {}, every=True)

    def _allowed(self, which: int, store: PairStore) -> Bools:
        """(CELLS,) False for cells outside of the interval that a yaw must be in."""
        base = store.tree.problem.arm.base
        if base.yaw_free:
            return np.ones(CELLS, dtype=np.bool_)
        off = self._yaws[which] - 0.5 * (base.yaw.low + base.yaw.high)
        off = np.abs(off - TURN * np.round(off / TURN))
        return np.asarray(off - 0.5 * base.yaw.width <= HALF + TOLERANCE)


def cell_costs(u: Floats, v: Floats, first: BestYaw, second: BestYaw) -> Floats:
    """(P, CELLS) what cells cost at least.

    Args:
        u: (P, CELLS) rad in [-π, π], yaw of the first arm in the middle of a cell, less its best one. v: of the second.
        first: best yaws (P,). second: likewise.
    """
    over = [first.radius[:, None] + _past(u), second.radius[:, None] + _past(v)]
    known = np.isfinite(over[0]) & np.isfinite(over[1])
    r, s = (np.where(known, radius, 0.0) for radius in over)
    both = first.weight + second.weight
    gap = np.abs(u + v) - r - s
    share = second.weight / both if both > 0.0 else 0.5
    apart = -u + np.sign(u + v) * (r + gap * share)
    inside = np.clip(0.0, np.maximum(-u - r, v - s), np.minimum(-u + r, v + s))
    t = np.clip(np.where(gap > 0.0, apart, inside), -HALF, HALF)
    cost = first.weight * np.maximum(np.abs(u + t) - r, 0.0) ** 2
    cost = cost + second.weight * np.maximum(np.abs(v - t) - s, 0.0) ** 2
    return np.asarray(np.where(known, np.maximum(cost - (first.paid + second.paid)[:, None], 0.0), 0.0))


def _past(off: Floats) -> Floats:
    """(P, CELLS) rad by which a cell that reaches beyond half a turn may be nearer than it seems."""
    return np.asarray(2.0 * np.maximum(np.abs(off) + HALF - np.pi, 0.0))
