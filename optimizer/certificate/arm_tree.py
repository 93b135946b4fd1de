"""Branch and bound of one arm among the surroundings of its cell: a tree of boxes that remembers everything.

As in `certify`, boxes of base positions with one posture each are bounded from below and cut in two, those with the
smallest bound first. Besides, boxes are excluded where the arm surely collides, and the tree is kept: pairs of arms
descend it from the roots (`pairs`), and what excluded its leaves says why a cell has no layout.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.certificate.alone import AloneCheck
from duocell.optimizer.certificate.bounds.box_bounds import LINEAR, PATH, SINGULAR, BoxBounder, BoxBounds
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.bounds.infeasibility_causes import CauseShares
from duocell.optimizer.certificate.bounds.region import MARGIN, Region, reachable_region
from duocell.optimizer.certificate.exclusion.causes import LIMITS, REACH, SINGULARITY
from duocell.optimizer.certificate.exclusion.causes import LINEAR as OF_SUMS
from duocell.optimizer.certificate.exclusion.exclude import NO_LEVELS, Excluder
from duocell.optimizer.certificate.nodes import Nodes
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed
from duocell.optimizer.verification.scene import Scene

FIRST_BOXES = 100
"""Boxes per posture to begin with, where a good layout is known: larger ones say little."""
SMALLEST_FIRST = 0.05
"""Side of the boxes to begin with, relative to the reach: no smaller than this."""
SMALLEST, FINEST = 1e-3, 1e-5
"""m; boxes with no longer half side are not cut any more, whatever their bound: where pairs of arms have to go on, and
where the arm by itself may suffice."""
ROWS, FEWEST = 12_000, 64
"""Poses times boxes bounded at once: few enough to stay in the processor's cache; and boxes in long tasks."""
BOUNDING = 0.15
"""Share of the time for a box that is bounded and tested which goes into the bound."""
CANDIDATES, LOOKED_AT = 12, 5
"""Places tried for a usable layout per round; and how many of them are looked at with the surroundings."""
USABLE = 1e-9
"""Violation (m and rad) up to which a path counts as usable."""


@dataclass(frozen=True, eq=False, slots=True)
class AloneLayout:
    """A usable layout of one arm by itself, and its objective."""

    point: ArmSolution
    objective: float


class ArmTree:
    """The tree of one arm.

    Attributes:
        problem: reduced problem of the arm on the full task. excluder: its tests. nodes: the boxes.
        region: of base positions within reach. cause_shares: what rules boxes out by reach, limits and steps.
        alone: the best usable layout of the arm by itself that was met.
        boxes: bounded so far. tested: of these, for collisions. levels: for the tests, see `Excluder`.
    """

    def __init__(self, scene: Scene, index: int, problem: ReducedProblem, known: bool = False) -> None:
        """Plant the tree: one box per posture.

        Args:
            scene: of the cell. index: of the arm. problem: its reduced problem on the full task.
            known: a layout of the cell is, so that costs are of interest; else nothing that a check lets pass is
                excluded: bases that are out of their region and hands that are off their poses by as little.
        """
        problem = problem.for_bounds()
        self.problem = problem
        self.bounder = BoxBounder.of(problem, checks=not known)
        kinematics = self.bounder.kinematics
        self.excluder = Excluder.of(scene, index, problem, kinematics, self.bounder.rules)
        self.check = AloneCheck.of(scene.cell, problem.arm)
        self.region = reachable_region(kinematics.targets, problem.arm.base.bounds[:3] + (not known) * MARGIN)
        self.cause_shares = CauseShares(problem, self.region)
        self.nodes = Nodes(_roots(self.region, problem))
        self.alone: AloneLayout | None = None
        self.boxes = self.tested = 0
        self.levels: Mapping[int, float] = NO_LEVELS
        self.batch = max(ROWS // len(problem.positions), FEWEST)

    @property
    def lower(self) -> float:
        """No layout of the arm costs less than this; inf if there is none."""
        return float(np.min(self.nodes.bound[self.nodes.leaves()], initial=np.inf))

    @property
    def work(self) -> float:
        """What was done, in boxes that are bounded and tested."""
        return BOUNDING * self.boxes + (1.0 - BOUNDING) * self.tested

    @property
    def empty(self) -> bool:
        """True if every box is excluded: the arm has no layout, even by itself."""
        return not np.any(self.nodes.code[self.nodes.leaves()] == 0)

    @property
    def alone_objective(self) -> float:
        """Objective of the best layout of the arm by itself; inf if none is known."""
        return np.inf if self.alone is None else self.alone.objective

    def sow(self, count: int = FIRST_BOXES) -> None:
        """Cut the roots without a look at them, to ``count`` boxes per posture or sides that are small for the arm."""
        nodes = self.nodes
        while len(nodes.leaves()) < count * len(nodes.roots):
            large = nodes.leaves()
            large = large[2.0 * nodes.size[large] > SMALLEST_FIRST * self.region.reach]
            if not len(large):
                return
            nodes.split(large)

    def work_off(self, cutoff: float, by_size: bool = False, smallest: float = SMALLEST) -> bool:
        """One round: bound and test some boxes, or cut some; False if nothing below ``cutoff`` is left to do.

        Args:
            cutoff: bounds from here on are good enough.
            by_size: largest boxes first in place of those with the smallest bounds: to exclude everything.
            smallest: m; boxes with no longer half side are not cut any more.
        """
        nodes = self.nodes
        leaves = nodes.leaves()
        leaves = leaves[(nodes.code[leaves] == 0) & (nodes.bound[leaves] < cutoff)]
        key = -nodes.size[leaves] if by_size else nodes.bound[leaves]
        fresh = ~nodes.bounded[leaves] | ~nodes.tested[leaves]
        if np.any(fresh):
            some = leaves[fresh][np.argsort(key[fresh], kind="stable")[: self.batch]]
            self.evaluate(some, cutoff)
            return True
        large = nodes.size[leaves] > smallest
        if not np.any(large):
            return False
        order = np.argsort(key[large], kind="stable")[: max(self.batch // 2, 1)]
        nodes.split(leaves[large][order])
        return True

    def evaluate(self, ids: Ints, cutoff: float, search: bool = True) -> None:
        """Bound boxes that have not been yet, and test those below ``cutoff``.

        Args:
            ids: of boxes. cutoff: bounds from here on are good enough.
            search: look for usable layouts in them too.
        """
        nodes = self.nodes
        for at in range(0, len(ids), self.batch):
            some = ids[at : at + self.batch]
            new = some[~nodes.bounded[some]]
            found = self._bound(new, cutoff) if len(new) else None
            ask = some[~nodes.tested[some] & (nodes.bound[some] < cutoff) & (nodes.code[some] == 0)]
            if len(ask):
                self._test(ask, cutoff)
            if search and found is not None:
                self._look_for_layouts(new, found, cutoff)

    def _bound(self, ids: Ints, cutoff: float) -> BoxBounds:
        nodes, boxes = self.nodes, self.nodes.boxes(ids)
        found = self.bounder.bounds(boxes, cutoff)
        self.cause_shares.add(boxes, found)
        self.boxes += len(ids)
        nodes.geometric[ids] = np.maximum(nodes.geometric[ids], found.lower)
        nodes.bound[ids] = np.maximum(nodes.bound[ids], found.lower)
        nodes.code[ids] = np.where(np.isinf(found.lower), _codes(found), 0)
        nodes.bounded[ids] = True
        return found

    def _test(self, ids: Ints, cutoff: float) -> None:
        nodes = self.nodes
        nodes.tested[ids] = True
        self.tested += len(ids)
        if not self.excluder.useful:
            return
        found = self.excluder(nodes.boxes(ids), nodes.geometric[ids], cutoff, self.levels)
        nodes.bound[ids] = np.maximum(nodes.bound[ids], found.bound)
        nodes.code[ids] = found.code

    def _look_for_layouts(self, ids: Ints, found: BoxBounds, cutoff: float) -> None:
        """Try the most promising places of boxes, and their centres."""
        nodes = self.nodes
        bound = np.where(nodes.code[ids] == 0, nodes.bound[ids], np.inf)
        order = np.argsort(np.where(bound < min(cutoff, self.alone_objective), bound, np.inf), kind="stable")
        order = order[:CANDIDATES][np.isfinite(bound[order[:CANDIDATES]])]
        if len(order):
            boxes = nodes.boxes(ids[order])
            self._try(found.promising[order], boxes.posture)
            self._try(boxes.centre, boxes.posture)

    def _try(self, places: Floats, postures: Ints) -> None:
        """Keep the best usable layout at some places (n, 3) in postures (n,), if it is better than what is known."""
        sides = self.problem.arm.base.bounds[:3]
        places = np.clip(places, sides[:, 0], sides[:, 1])
        paths = evaluate_signed(self.problem, places, np.array(ALL_SIGNS)[postures])
        objective = np.where(paths.violation[0] <= USABLE, paths.objective[0], np.inf)
        for k in np.argsort(objective, kind="stable")[:LOOKED_AT]:
            if objective[k] >= self.alone_objective:
                return
            joints = paths.joints[:, 0, k].T
            point = ArmSolution(places[k], float(paths.yaw[0, k]), joints, ALL_SIGNS[postures[k]])
            if self.check.usable(point):
                self.alone = AloneLayout(point, float(objective[k]))


def _roots(region: Region, problem: ReducedProblem) -> Boxes:
    return Boxes.grid(region.low, region.high, np.inf, problem.postures & (not region.empty))


def _codes(found: BoxBounds) -> Ints:
    """(N,) numbers of the causes that rule boxes out: reach, or else the first joint that does, or else their sums."""
    causes = found.causes
    joint = np.argmax(causes[1:] > 0, axis=0)
    kind = causes[joint + 1, np.arange(causes.shape[1])]
    code: Ints = np.where(kind == SINGULAR, SINGULARITY, LIMITS + joint + np.where(kind == PATH, 6, 0))
    code = np.where(kind == LINEAR, OF_SUMS, code)
    return np.where(causes[0] > 0, REACH, code)
