r"""One base yaw for several jobs: the shifts of joint 1 that suit them best together.

A yaw shifts joint 1 by the same y in all jobs; each job may be lifted by 2π k_b on top of that. With t_b the shift a
job would like best and W_b its weight, what depends on them costs ``Σ_b W_b (y + 2π k_b - t_b)²``, where
``y + 2π k_b`` has to lie between low_b and high_b. For a given y the best k_b is a clipped rounding, and it changes
only at ``t_b + π``, low_b and high_b (modulo 2π). Between two such places all k_b are constant and the cost is a
parabola in y, so the best of the clipped vertices is the global minimum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arm import TURN
from models.arrays import Floats

ROUNDING = 1e-12
"""rad"""


@dataclass(frozen=True, eq=False, slots=True)
class Shifted:
    """The best shifts of B jobs; S is any shape.

    Attributes:
        yaw_shift: (S) rad, y. turns: (B, S) k_b. cost: (S), inf where no y suits every job.
    """

    yaw_shift: Floats
    turns: Floats
    cost: Floats


@dataclass(frozen=True, eq=False, slots=True)
class JobShifts:
    """What B jobs ask of the shift of joint 1.

    Attributes:
        wanted: (B, S) rad, t_b. weights: (B,) W_b.
        low: (B, S) rad, smallest shift that the limits allow, may be infinite. high: (B, S) rad, largest.
        start: (S) rad, or one number for all; y lies in [start, start + width].
        width: rad, at most 2π.
    """

    wanted: Floats
    weights: Floats
    low: Floats
    high: Floats
    start: Floats
    width: float

    def best(self, least: Floats | None = None, most: Floats | None = None) -> Shifted:
        """The cheapest shifts, where asked for with turns between ``least`` and ``most`` (B, S)."""
        ends = self._ends()
        low, high = ends[..., :-1], ends[..., 1:]
        middle = 0.5 * (low + high)
        total = float(np.sum(self.weights))
        shares = self.weights / total if total > 0.0 else np.full(len(self.weights), 1.0 / len(self.weights))
        turns = np.empty((len(self.wanted), *middle.shape))
        vertex, possible = np.zeros(middle.shape), np.ones(middle.shape, dtype=np.bool_)
        for b, share in enumerate(shares):
            first = np.ceil((self.low[b, ..., None] - middle) / TURN - ROUNDING)
            last = np.floor((self.high[b, ..., None] - middle) / TURN + ROUNDING)
            if least is not None and most is not None:
                first, last = np.maximum(first, least[b, ..., None]), np.minimum(last, most[b, ..., None])
            possible &= first <= last
            turns[b] = np.clip(np.round((self.wanted[b, ..., None] - middle) / TURN), first, last)
            vertex += share * (self.wanted[b, ..., None] - TURN * np.where(possible, turns[b], 0.0))
        vertex = np.clip(vertex, low, high)
        off = np.where(possible, vertex + TURN * turns - self.wanted[..., None], 0.0)
        cost = np.where(possible, np.einsum("b,b...->...", self.weights, off**2), np.inf)
        return _picked(vertex, turns, cost)

    def nearest(self) -> Shifted:
        """The shifts that stick out of the limits least, for where none keeps them; the cost is what sticks out."""
        places = self._ends()  # what sticks out is concave between them
        limited = np.isfinite(self.low + self.high)
        with np.errstate(invalid="ignore"):  # limits of a joint without end
            centre = np.where(limited, 0.5 * (self.low + self.high), np.clip(self.wanted, self.low, self.high))
        turns = np.round((centre[..., None] - places) / TURN)
        shift = places + TURN * turns
        outside = np.maximum(self.low[..., None] - shift, 0.0) + np.maximum(shift - self.high[..., None], 0.0)
        return _picked(places, turns, np.sum(outside, axis=0))

    def _ends(self) -> Floats:
        """(S, P + 1) rad, where the pieces of one allowed stretch of y begin and end, ascending."""
        kinks = np.concatenate([self.wanted + np.pi, self.low, self.high])
        kinks = np.where(np.isfinite(kinks), kinks, self.start)
        offsets = np.minimum(np.mod(kinks - self.start, TURN), self.width)
        zero = np.zeros((1, *offsets.shape[1:]))
        offsets = np.sort(np.concatenate([zero, offsets, zero + self.width]), axis=0)
        ends: Floats = np.moveaxis(offsets + self.start, 0, -1)
        return ends


def _picked(places: Floats, turns: Floats, cost: Floats) -> Shifted:
    """The cheapest of the places (S, P)."""
    best = np.argmin(cost, axis=-1, keepdims=True)
    return Shifted(
        np.take_along_axis(places, best, axis=-1)[..., 0],
        np.take_along_axis(turns, best[None], axis=-1)[..., 0],
        np.take_along_axis(cost, best, axis=-1)[..., 0],
    )
