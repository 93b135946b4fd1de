"""Base positions to be looked at first, in a frame that turns and moves with the task.

A sample that is even but tied to the world's axes finds other basins when the world is turned. So the sample is made
in a box at the origin, and turned by the quarter turn that brings its axes to the task: the box of the search is one
along the world's axes, so other angles need not be told apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.reduction.box import spread
from duocell.optimizer.reduction.reduced import ReducedProblem

FIRST = 0.3
"""rad, where the first quarter of directions begins: off the axes, where directions of drawn-up tasks lie."""
VAGUE = 1e-6
"""A direction that is shorter (m, or of unit vectors) says nothing."""
EDGE = 7
"""Points on each edge of the box beside its corners; on an edge or in a corner optima of narrow boxes are."""


@dataclass(frozen=True, eq=False, slots=True)
class BoxFrame:
    """A box of base positions and how a sample is turned in it.

    Attributes:
        box: (3, 2) m. quarter: quarter turns about the vertical from the sample's axes to the world's.
    """

    box: Floats
    quarter: int

    @staticmethod
    def of(problem: ReducedProblem, box: Floats) -> BoxFrame:
        """The frame of a task in a box."""
        weights = np.ones(len(problem.positions)) if problem.weights is None else problem.weights
        shares = weights / np.sum(weights) if np.any(weights) else np.full(len(weights), 1.0 / len(weights))
        turned = np.einsum("m,ij,mjk->ik", shares, problem.arm.mount, problem.rotations)
        directions = [shares @ problem.positions - 0.5 * (box[:, 0] + box[:, 1]), *turned.T[::-1]]
        clear = [direction for direction in directions if np.hypot(direction[0], direction[1]) > VAGUE]
        if not clear:
            return BoxFrame(box, 0)
        angle = float(np.arctan2(clear[0][1], clear[0][0]))
        return BoxFrame(box, int(np.floor((angle - FIRST) / (0.5 * np.pi))) % 4)

    def turned(self, offsets: Floats) -> Floats:
        """Offsets (..., 3) in the sample's axes, in the world's."""
        x, y, z = np.moveaxis(offsets, -1, 0)
        turned = ((x, y), (-y, x), (-x, -y), (y, -x))[self.quarter]
        return np.stack([*turned, z], axis=-1)

    def sample(self, count: int, seed: int) -> Floats:
        """(about ``count``, 3) m, positions in the box: even inside, and along the edges if only x and y are free."""
        width = self.box[:, 1] - self.box[:, 0]
        centre = 0.5 * (self.box[:, 0] + self.box[:, 1])
        own = width[[1, 0, 2]] if self.quarter % 2 else width
        half = 0.5 * np.stack([-own, own], axis=-1)
        offsets = spread(half, count, seed)
        if own[0] > 0.0 and own[1] > 0.0 and own[2] == 0.0:
            border = 0.5 * own * _border()
            offsets = np.concatenate([border, offsets[: max(count - len(border), 0)]])
        return np.clip(centre + self.turned(offsets), self.box[:, 0], self.box[:, 1])


def _border() -> Floats:
    """(4 + 4 EDGE, 3) corners and edges of the square from -1 to 1."""
    corners = [(x, y, 0.0) for x, y in product((-1.0, 1.0), repeat=2)]
    inner = np.linspace(-1.0, 1.0, EDGE + 2)[1:-1]
    edges = [(x, y, 0.0) for side in (-1.0, 1.0) for t in inner for x, y in ((side, t), (t, side))]
    return np.array(corners + edges)
