r"""Lower bounds of two arms' cost together over pairs of boxes, where couplings tie their bases.

Each arm by itself would have its base where it suits it best in its box; tied, both have to give way. The linearised
problems of both (`bounds.tangent`) are solved as one: their variables side by side, the couplings as rows without a
weight between their limits (`ties`). Weak duality (`bounds.linear`) makes of any multipliers of these rows a bound of
all layouts that keep them. Turns of joint 1 that a linearised problem leaves out cost what is known of them, with the
other arm's own bound. Mirrored yaws are a row on the turn on which the best shifts nearly fit; on any other turn they
are off by at least ``D = 2π - off - r_1 - r_2``, which costs no less than ``D² V_1 V_2 / (V_1 + V_2)``
(`mirrored_yaw`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.coupling import Coupling
from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.bounds.linear import Linear
from duocell.optimizer.certificate.pairs.mirrored_yaw import BestYaw, sum_of_yaws
from duocell.optimizer.certificate.pairs.ties import Tie, mirrored_yaws, ties, yaw_tie

ROWS = 60_000
"""Rows of linearised problems times pairs that are solved at once."""


@dataclass(frozen=True, eq=False, slots=True)
class TiedBounds:
    """Bounds of two tied arms.

    Attributes:
        couplings: of the cell. arms: indices of the two. trees: of them.
    """

    couplings: tuple[Coupling, ...]
    arms: tuple[int, int]
    trees: tuple[ArmTree, ArmTree]

    @property
    def useful(self) -> bool:
        """True if some coupling has a row here (`ties`) for both arms."""
        nowhere = Boxes(np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1, dtype=np.int64))
        rows = ties(self.couplings, self.arms, nowhere, nowhere)
        return bool(rows) or bool(mirrored_yaws(self.couplings, self.arms))

    def __call__(self, first: Ints, second: Ints, yaws: tuple[BestYaw, BestYaw]) -> Floats:
        """(P,) no layout in pairs of boxes costs less.

        Args:
            first: (P,) numbers of boxes of the one arm, bounded and not excluded. second: of the other.
            yaws: best yaws over them.
        """
        lower = np.zeros(len(first))
        rows = 12 * max(len(tree.problem.positions) for tree in self.trees)
        step = max(ROWS // rows, 1)
        for at in range(0, len(first), step):
            some = np.arange(at, min(at + step, len(first)))
            lower[some] = self._bounds(first[some], second[some], (yaws[0][some], yaws[1][some]))
        return lower

    def _bounds(self, first: Ints, second: Ints, yaws: tuple[BestYaw, BestYaw]) -> Floats:
        parts, geometric = [], []
        for tree, ids in zip(self.trees, (first, second), strict=True):
            own, back = np.unique(ids, return_inverse=True)
            parts.append(tree.bounder.linearised(tree.nodes.boxes(own))[back])
            geometric.append(tree.nodes.geometric[ids])
        boxes = self.trees[0].nodes.boxes(first), self.trees[1].nodes.boxes(second)
        rows = ties(self.couplings, self.arms, *boxes)
        elsewhere = np.full(len(first), np.inf)
        sigma = self.trees[0].problem.sigma, self.trees[1].problem.sigma
        for total in mirrored_yaws(self.couplings, self.arms):
            here, more = sum_of_yaws(total, *yaws)
            known = parts[0].turned & parts[1].turned & (more > 0.0)
            rows.append(yaw_tie(here, known, sigma))
            elsewhere = np.where(known, np.minimum(elsewhere, geometric[0] + geometric[1] + more), elsewhere)
        linear = _joined(parts[0].linear, parts[1].linear, rows)
        together = np.maximum(linear.solve(np.hstack([part.start for part in parts]))[1], 0.0)
        together += parts[0].constant + parts[1].constant
        one, other = parts[0].others + geometric[1], parts[1].others + geometric[0]
        return np.asarray(np.minimum(np.minimum(together, elsewhere), np.minimum(one, other)))


def _joined(first: Linear, second: Linear, rows: list[Tie]) -> Linear:
    """Two linearised problems of P pairs as one, with rows that tie their variables."""
    count, one, own = first.slopes.shape
    other, others = second.slopes.shape[1:]
    slopes = np.zeros((count, one + other + len(rows), own + others))
    slopes[:, :one, :own], slopes[:, one : one + other, own:] = first.slopes, second.slopes
    for k, row in enumerate(rows, start=one + other):
        slopes[:, k, : own - 1], slopes[:, k, own : own + others - 1] = (
            row.first[:, : own - 1],
            row.second[:, : others - 1],
        )
        slopes[:, k, own - 1], slopes[:, k, own + others - 1] = row.turns
    nothing = np.zeros((count, len(rows)))
    ends = [np.stack([getattr(row, name) for row in rows], axis=1) for name in ("low", "high")]
    return Linear(
        error=np.hstack([first.error, second.error, *(row.value[:, None] for row in rows)]),
        slopes=slopes,
        rest=np.hstack([first.rest, second.rest, *(row.rest[:, None] for row in rows)]),
        weights=np.hstack([first.weights, second.weights, nothing]),
        limits=np.concatenate([first.limits, second.limits, np.stack(ends)], axis=2),
        low=np.hstack([first.low, second.low]),
        high=np.hstack([first.high, second.high]),
    )
