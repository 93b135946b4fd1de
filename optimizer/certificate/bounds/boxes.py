"""Boxes of base positions, each with one posture: the nodes of the branch and bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.robot.posture import ALL_SIGNS

_SIGNS = np.array(ALL_SIGNS, dtype=np.int64)


@dataclass(frozen=True, eq=False, slots=True)
class Boxes:
    """N boxes of base positions in the world.

    Attributes:
        centre: (N, 3) m. half: (N, 3) m, half the side lengths; 0 for fixed coordinates.
        posture: (N,) index into `duocell.models.robot.posture.ALL_SIGNS`.
    """

    centre: Floats
    half: Floats
    posture: Ints

    def __len__(self) -> int:
        return len(self.posture)

    def __getitem__(self, index: Ints | Bools | slice) -> Boxes:
        return Boxes(self.centre[index], self.half[index], self.posture[index])

    @property
    def signs(self) -> Ints:
        """(N, 3) signs of shoulder, elbow and wrist."""
        signs: Ints = _SIGNS[self.posture]
        return signs

    def sign(self, which: int) -> Floats:
        """(N, 1) sign of the shoulder (0), the elbow (1) or the wrist (2), to go with arrays (N, m)."""
        return self.signs[:, which, None].astype(np.float64)

    def halved(self) -> Boxes:
        """Every box cut in two across its longest side: (2N), the lower halves first."""
        rows = np.arange(len(self))
        longest = np.argmax(self.half, axis=1)
        half = self.half.copy()
        half[rows, longest] *= 0.5
        shift = np.zeros_like(half)
        shift[rows, longest] = half[rows, longest]
        return Boxes(
            np.concatenate([self.centre - shift, self.centre + shift]),
            np.concatenate([half, half]),
            np.concatenate([self.posture, self.posture]),
        )

    def within(self, sides: Floats) -> tuple[Boxes, Bools]:
        """What of the boxes is within sides (3, 2) m, and (N,) False for those of which nothing is."""
        low = np.maximum(self.centre - self.half, sides[:, 0])
        high = np.minimum(self.centre + self.half, sides[:, 1])
        left: Bools = np.all(low <= high, axis=1)
        return Boxes(0.5 * (low + high)[left], 0.5 * (high - low)[left], self.posture[left]), left

    @staticmethod
    def joined(parts: list[Boxes]) -> Boxes:
        """All boxes of several sets."""
        return Boxes(
            np.concatenate([p.centre for p in parts]),
            np.concatenate([p.half for p in parts]),
            np.concatenate([p.posture for p in parts]),
        )

    @staticmethod
    def grid(low: Floats, high: Floats, side: float, postures: Bools) -> Boxes:
        """A region (3,) to (3,) cut into boxes of about ``side`` m, once for every admitted posture (8,)."""
        counts = np.maximum(np.ceil((high - low) / side), 1.0).astype(int)
        half = 0.5 * (high - low) / counts
        lines = [low[k] + half[k] * (2.0 * np.arange(counts[k]) + 1.0) for k in range(3)]
        places = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
        allowed = np.flatnonzero(postures)
        return Boxes(
            np.repeat(places, len(allowed), axis=0),
            np.tile(half, (len(places) * len(allowed), 1)),
            np.tile(allowed, len(places)).astype(np.int64),
        )
