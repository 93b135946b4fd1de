"""Proof for a cell whose arms meet each other or their surroundings: the trees of its arms, then pairs of boxes.

No layout costs less than the sum of what the arms cost by themselves among the surroundings, nor less than what two of
them cost together and the others by themselves. The arms' trees are worked off in turn until the sum of their bounds is
good enough, or no arm's own bound can rise any more; then pairs of boxes, from the roots. Where no layout is known the
same trees try to exclude everything; what they meet is refined, and the proof goes on with it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from duocell.optimizer.certificate.arm_tree import FINEST, SMALLEST, ArmTree
from duocell.optimizer.certificate.pairs.pair_tree import PairTree
from duocell.optimizer.certificate.proposals import Proposals
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.settings import CertificateSettings
from duocell.optimizer.sqp.refine import Refined
from duocell.optimizer.verification.scene import Scene

ROUNDING = 1e-7
"""Relative slack of the bound that is reported: constants of catalogue robots are known to about as much."""
TIGHT, LOOSE = 0.25, 1.0
"""An arm's own bound need not come nearer to its own best layout than so many gaps: where the arms by themselves may
do, and where pairs have to go on anyway."""
ALONE, BLIND, BRIEF = 0.75, 0.5, 0.2
"""Shares of the budget for the arms by themselves where pairs can do more: while they may suffice, as long as some arm
has no layout by itself yet, and where they cannot suffice."""
LOWER = 1e-3
"""Relative; what the arms do by themselves is looked at together again once one of them does so much better."""
PAIR = 0.25
"""Boxes that a pair counts for: looking at one takes about so much of the time that bounding and testing a box does."""

Report = Callable[[float, float | None, int], None]
"""Called after every round with the lower bound, the best objective known (or None) and the boxes so far."""


@dataclass(frozen=True, eq=False, slots=True)
class ArmPart:
    """What is known of one arm among its surroundings, without the others.

    Attributes:
        lower: it costs no less; inf if it has no layout. boxes: bounded. tree: its boxes, with causes.
    """

    lower: float
    boxes: int
    tree: ArmTree

    @property
    def infeasible(self) -> bool:
        """True if the arm has no layout, even by itself."""
        return bool(np.isinf(self.lower))


@dataclass(frozen=True, eq=False, slots=True)
class CellProof:
    """What was shown.

    Attributes:
        lower: no layout of the cell costs less; inf if there is none.
        arms: the arms by themselves. pairs: the pairs of arms that were looked at.
        known: clean layouts, best first; the proof may have found better ones.
        boxes: bounded and tested over all trees; what is only bounded, and pairs, count for less.
        ended: False if its time limit cut the proof.
    """

    lower: float
    arms: tuple[ArmPart, ...]
    pairs: tuple[PairTree, ...]
    known: list[Refined]
    boxes: int
    ended: bool

    @property
    def infeasible(self) -> bool:
        """True if there is no layout."""
        return bool(np.isinf(self.lower)) and not self.known


def prove_cell(
    scene: Scene,
    problems: Sequence[ReducedProblem],
    known: Sequence[Refined],
    settings: CertificateSettings,
    report: Report | None = None,
) -> CellProof:
    """Bound a cell's objective from below, or show that it has no layout.

    Args:
        scene: the cell. problems: reduced problems of its arms on the full task, in order.
        known: clean layouts, best first.
        settings: relative gap to reach, time limit and number of boxes.
        report: told after every round.

    Raises:
        Cancelled: whoever watches (`duocell.optimizer.monitoring.watch`) wants an end.
    """
    proof = _Proof(scene, problems, known, settings, report)
    proof.arms_alone()
    if len(problems) > 1 and not proof.settled:
        proof.pairs_of_arms()
    return proof.result()


class _Proof:
    """The state of a proof."""

    def __init__(
        self,
        scene: Scene,
        problems: Sequence[ReducedProblem],
        known: Sequence[Refined],
        settings: CertificateSettings,
        report: Report | None,
    ) -> None:
        self.began = time.perf_counter()
        self.scene, self.settings, self.report = scene, settings, report
        self.known = list(known)
        self.trees = [ArmTree(scene, index, problem, bool(self.known)) for index, problem in enumerate(problems)]
        self.alone = np.zeros(len(problems))  # bounds of the arms by themselves
        self.tried = np.full(len(problems), np.inf)  # objectives of arms by themselves that are worth another look
        self.pairs: dict[tuple[int, int], PairTree] = {}
        self.proposals = Proposals(scene, self.trees, self.known, self.began + settings.time_limit)
        if self.known:
            for tree in self.trees:
                tree.sow()

    @property
    def objective(self) -> float:
        """Of the best layout known."""
        return self.known[0].objective if self.known else np.inf

    @property
    def cutoff(self) -> float:
        """A bound of the cell that reaches this is good enough."""
        best = self.objective
        return best if np.isinf(best) else (best - self.settings.gap * max(best, 1e-9)) * (1.0 + 2.0 * ROUNDING)

    @property
    def lower(self) -> float:
        """No layout of the cell costs less: the arms by themselves, and the pair of them that tells most."""
        gains = [pair.lower - self.alone[a] - self.alone[b] for (a, b), pair in self.pairs.items()]
        total = float(np.sum(self.alone))
        return total if np.isinf(total) else total + max([0.0, *gains])

    @property
    def settled(self) -> bool:
        """True if nothing is left to show."""
        return bool(self.lower >= self.cutoff)

    @property
    def boxes(self) -> int:
        """Boxes bounded and tested; boxes that are only bounded and pairs count for less."""
        pairs = sum(pair.looked_at for pair in self.pairs.values())
        return int(sum(tree.work for tree in self.trees) + PAIR * pairs)

    @property
    def late(self) -> bool:
        """True once the time is up."""
        return time.perf_counter() - self.began > self.settings.time_limit

    def spent(self, share: float = 1.0) -> bool:
        """True once a share of the budget is used up."""
        by_time = time.perf_counter() - self.began > share * self.settings.time_limit
        return by_time or (self.settings.boxes is not None and self.boxes >= share * self.settings.boxes)

    def arms_alone(self) -> None:
        """Work off the trees of the arms in turn, the one with the fewest boxes first."""
        open_ = set(range(len(self.trees)))
        while open_ and not self.settled and not self.spent(self._share_alone()):
            index = min(open_, key=lambda k: (self.trees[k].work, k))
            if not self._work_off(index):
                open_.discard(index)
            self._tell()

    def _share_alone(self) -> float:
        """Share of the budget that the arms by themselves may take."""
        if not self._more_by_pairs():
            return 1.0
        if not self._alone_may_do():
            return BRIEF
        blind = self.known and any(tree.alone is None for tree in self.trees)
        return BLIND if blind else ALONE

    def _more_by_pairs(self) -> bool:
        """True if arms can be excluded by each other."""
        meet = self.scene.cell.surroundings.clearances.arm_arm is not None
        return len(self.trees) > 1 and (meet or bool(self.scene.cell.couplings))

    def _alone_may_do(self) -> bool:
        """True while the best that the arms are known to do by themselves would be good enough as a bound."""
        return sum(tree.alone_objective for tree in self.trees) >= self.cutoff

    def _work_off(self, index: int) -> bool:
        """One round of an arm's tree; False if there is no use in another one."""
        tree, others = self.trees[index], float(np.sum(self.alone) - self.alone[index])
        if tree.alone_objective < self.tried[index]:
            self.tried[index] = tree.alone_objective * (1.0 - LOWER)
            self.proposals.look_alone()
        if not self.known:
            more = tree.work_off(np.inf, by_size=True)
            self.alone[index] = np.inf if tree.empty else 0.0
            return more and (tree.alone is None or len(self.trees) == 1)
        may_do = self._alone_may_do()
        tight = TIGHT if may_do else LOOSE
        enough = min(self.cutoff - others, tree.alone_objective * (1.0 - tight * self.settings.gap))
        more = tree.work_off(enough, smallest=FINEST if may_do else SMALLEST)
        self.alone[index] = max(self.alone[index], tree.lower)
        return more and self.alone[index] < enough

    def pairs_of_arms(self) -> None:
        """Work off the pairs of boxes of every two arms that meet or are tied to each other."""
        for tree in self.trees:
            tree.nodes.settle()
        couples = list(combinations(range(len(self.trees)), 2))
        for number, (a, b) in enumerate(couples):
            self.pairs[a, b] = PairTree(self.scene, (self.trees[a], self.trees[b]), (a, b))
            share = ALONE + (1.0 - ALONE) * (number + 1) / len(couples)
            self._work_off_pairs(a, b, share)
            if self.settled:
                return

    def _work_off_pairs(self, a: int, b: int, share: float) -> None:
        pairs = self.pairs[a, b]
        others = float(np.sum(self.alone) - self.alone[a] - self.alone[b])
        while len(pairs.bound) and not self.settled and not self.spent(share):
            before = len(self.known)
            left = pairs.round(self.cutoff - others, by_size=not self.known)
            if len(self.trees) == 2:
                self.proposals.look(*left)
            if len(self.known) > before == 0:  # bounds were of no interest until now
                self.alone[:] = [tree.lower for tree in self.trees]
            self._tell()

    def _tell(self) -> None:
        check_stop()
        if self.report is not None:
            best = None if np.isinf(self.objective) else self.objective
            self.report(self.lower, best, self.boxes)

    def result(self) -> CellProof:
        """What has been shown."""
        lower = self.lower
        return CellProof(
            lower=lower if np.isinf(lower) else lower * (1.0 - ROUNDING),
            arms=tuple(
                ArmPart(float(bound), tree.boxes, tree) for bound, tree in zip(self.alone, self.trees, strict=True)
            ),
            pairs=tuple(self.pairs.values()),
            known=self.known,
            boxes=self.boxes,
            ended=self.settled or not self.late,
        )
