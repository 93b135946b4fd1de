r"""One base yaw for several segments: the shifts of joint 1 that suit them best together.

A yaw shifts joint 1 by the same y in all segments; each segment may be shifted by 2π k_b on top of that. With t_b the
shift a segment would like best and W_b its weight, what depends on them costs ``Σ_b W_b (y + 2π k_b - t_b)²``, where
``y + 2π k_b`` has to lie between low_b and high_b. For a given y the best k_b is a clipped rounding, and it changes
only at ``t_b + π``, low_b and high_b (modulo 2π). Between two such places all k_b are constant and the cost is a
parabola in y, so the best of the clipped vertices is the global minimum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.robot.arm import TURN

ROUNDING = 1e-12
"""rad"""


@dataclass(frozen=True, eq=False, slots=True)
class Shifted:
    """The best shifts of B segments; S is any shape.

    Attributes:
        yaw_shift: (S) rad, y. turns: (B, S) k_b. cost: (S), inf where no y suits every segment.
    """

    yaw_shift: Floats
    turns: Floats
    cost: Floats


@dataclass(frozen=True, eq=False, slots=True)
class SegmentShifts:
    """What B segments ask of the shift of joint 1.

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
        segments = range(len(self.wanted))
        limits = [
            (-np.inf, np.inf) if least is None or most is None else (least[b, ..., None], most[b, ..., None])
            for b in segments
        ]
        total = float(np.sum(self.weights))
        shares = self.weights / total if total > 0.0 else np.full(len(segments), 1.0 / len(segments))
        vertex, possible = np.zeros(middle.shape), np.ones(middle.shape, dtype=np.bool_)
        for b in segments:
            turns, kept = self._turns(b, middle, *limits[b])
            vertex += shares[b] * (self.wanted[b, ..., None] - TURN * turns)
            possible &= kept
        vertex, cost = np.clip(vertex, low, high), np.zeros(middle.shape)
        for b in segments:
            turns, _ = self._turns(b, middle, *limits[b])
            cost += self.weights[b] * (vertex + TURN * turns - self.wanted[b, ..., None]) ** 2
        chosen = np.argmin(np.where(possible, cost, np.inf), axis=-1)[..., None]
        piece = np.take_along_axis(middle, chosen, axis=-1)
        return Shifted(
            np.take_along_axis(vertex, chosen, axis=-1)[..., 0],
            np.array([self._turns(b, piece, *limits[b])[0][..., 0] for b in segments]),
            np.take_along_axis(np.where(possible, cost, np.inf), chosen, axis=-1)[..., 0],
        )

    def _turns(self, b: int, places: Floats, least: Floats | float, most: Floats | float) -> tuple[Floats, Bools]:
        """The best turn of segment b for y at ``places`` (S, P), and where the limits allow one; elsewhere it is 0."""
        first = np.maximum(np.ceil((self.low[b, ..., None] - places) / TURN - ROUNDING), least)
        last = np.minimum(np.floor((self.high[b, ..., None] - places) / TURN + ROUNDING), most)
        turns = np.clip(np.round((self.wanted[b, ..., None] - places) / TURN), first, last)
        kept: Bools = first <= last
        return np.where(kept, turns, 0.0), kept

    def nearest(self) -> Shifted:
        """The shifts that stick out of the limits least, for where none keeps them; the cost is what sticks out."""
        places = self._ends()  # what sticks out is concave between them
        with np.errstate(invalid="ignore"):  # limits of a joint without end
            centre = 0.5 * (self.low + self.high)
        centre = np.where(np.isfinite(centre), centre, np.clip(self.wanted, self.low, self.high))
        outside = np.zeros(places.shape)
        for low, high, middle in zip(self.low[..., None], self.high[..., None], centre[..., None], strict=True):
            shift = places + TURN * np.round((middle - places) / TURN)
            outside += np.maximum(low - shift, 0.0) + np.maximum(shift - high, 0.0)
        chosen = np.argmin(outside, axis=-1)[..., None]
        y = np.take_along_axis(places, chosen, axis=-1)[..., 0]
        return Shifted(y, np.round((centre - y) / TURN), np.take_along_axis(outside, chosen, axis=-1)[..., 0])

    def _ends(self) -> Floats:
        """(S, P + 1) rad, where the pieces of one allowed stretch of y begin and end, ascending."""
        kinks = np.concatenate([self.wanted + np.pi, self.low, self.high])
        kinks = np.where(np.isfinite(kinks), kinks, self.start)
        offsets = np.minimum(np.mod(kinks - self.start, TURN), self.width)
        zero = np.zeros((1, *offsets.shape[1:]))
        offsets = np.sort(np.concatenate([zero, offsets, zero + self.width]), axis=0)
        ends: Floats = np.moveaxis(offsets + self.start, 0, -1)
        return ends
