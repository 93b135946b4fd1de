"""Does a part of what a cell asks for leave a layout? Proofs on trees of boxes, which answer for smaller parts as well.

What excluded a box is kept with it. Where something is no longer asked for, only the boxes that it may have excluded,
and the pairs of boxes that were lost with them, have to be looked at again; all others stay excluded.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from duocell.models.base.arrays import Ints
from duocell.models.cell.cell import Cell
from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.exclusion.causes import (
    BELOW,
    CONDITIONING,
    FLOOR,
    LIMITS,
    LINEAR,
    SINGULARITY,
    YAW,
    Causes,
)
from duocell.optimizer.certificate.pairs.pair_tree import PairTree
from duocell.optimizer.certificate.proposals import Proposals
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.requirements import Kind, Requirement, Selection, arms_of, restricted
from duocell.optimizer.infeasibility.searched.trial import clean
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.sqp.refine import Refined
from duocell.optimizer.verification.scene import Scene

BOXES, PAIRS = 6000, 60_000
"""Of a tree, and pairs, looked at in one proof at most."""
JOINTS = 6
"""Of arms that have such trees."""
WITH_OTHERS = 5
"""Joint, from 0, whose exclusions may rest on joints 2 to 5 as well: bounds of their sum are noted there."""
REBUILT = (Kind.REGION, Kind.POSTURE, Kind.ARM)
"""What the roots of the trees depend on."""


class SubsetProof:
    """Some arms of a cell, and what they are asked for.

    Attributes:
        selection: what is asked for. cell: that and nothing else. arms: indices of its arms in the whole cell.
        trees: of its arms. pairs: of boxes of every two of them; empty until they are looked at.
        infeasible: True once it is proved that no layout is left. layout: one that passes every check, or None.
    """

    def __init__(self, whole: Cell, selection: Selection, before: SubsetProof | None = None) -> None:
        """Prepare a proof; ``before`` is one for a larger selection, whose roots are the same.

        Raises:
            ValueError: an arm without a reduced problem.
        """
        self.whole, self.selection, self.cell = whole, selection, restricted(whole, selection)
        self.arms, self.scene = arms_of(whole, selection), Scene.of(self.cell)
        self.trees = [self._planted(index) for index in range(len(self.arms))]
        self.pairs: dict[tuple[int, int], PairTree] = {}
        self.infeasible, self.layout = False, None if before is None else _kept(self.scene, before)
        if before is not None and self.layout is None:
            self._inherit(before)

    def _planted(self, index: int) -> ArmTree:
        check_stop()
        problem = reduced_problem(self.cell, self.cell.arms[index])
        if problem is None:
            raise ValueError(f"{self.cell.arms[index].name} has no reduced problem")
        return ArmTree(self.scene, index, problem)

    def _inherit(self, before: SubsetProof) -> None:
        """Take the boxes and pairs over, but for what may rest on what is no longer asked for."""
        dropped = before.selection.requirements - self.selection.requirements
        for index, (tree, old) in enumerate(zip(self.trees, before.trees, strict=True)):
            codes = _translation(old.excluder.causes, tree.excluder.causes)
            for requirement in dropped:
                codes[numbers_of(self.whole, self.arms[index], old.excluder.causes, requirement)] = 0
            tree.nodes = old.nodes.translated(codes)
            tree.alone = old.alone
        for (a, b), pair in before.pairs.items():
            self.pairs[a, b] = pair.reopened(self.scene, (self.trees[a], self.trees[b]))

    @property
    def decided(self) -> bool:
        """True once it is known whether there is a layout."""
        return self.infeasible or self.layout is not None

    def run(self, effort: Effort) -> None:
        """Work on the proof until it is decided, or as long as there is something to spend."""
        for index in range(len(self.trees)):
            if self.decided or effort.over:
                return
            self._work_off(index, effort)
        if self.decided or effort.over or any(tree.alone is None for tree in self.trees):
            return
        if len(self.trees) > 1:
            self._look_at_pairs(effort)

    def _work_off(self, index: int, effort: Effort) -> None:
        """One arm by itself, until it is excluded or has a layout."""
        tree = self.trees[index]
        while not tree.empty and tree.alone is None and tree.boxes < BOXES and not effort.over:
            check_stop()
            before, more = tree.work, tree.work_off(np.inf, by_size=True)
            effort.boxes(self.cell, tree.work - before)
            if not more:
                break
        self.infeasible |= tree.empty
        if len(self.trees) == 1 and tree.alone is not None and clean(self.scene, [tree.alone.point]):
            self.layout = (tree.alone.point,)

    def _look_at_pairs(self, effort: Effort) -> None:
        """Every two arms, each of which has a layout by itself."""
        known: list[Refined] = []
        proposals = Proposals(self.scene, self.trees, known, effort.deadline)
        proposals.look_alone()
        for a, b in combinations(range(len(self.trees)), 2):
            if (a, b) not in self.pairs:
                for index in (a, b):
                    self.trees[index].nodes.settle()
                self.pairs[a, b] = PairTree(self.scene, (self.trees[a], self.trees[b]), (a, b))
            pairs = self.pairs[a, b]
            while len(pairs.bound) and not known and pairs.looked_at < PAIRS and not effort.over:
                check_stop()
                self._round(pairs, proposals, effort)
            self.infeasible |= pairs.lower == np.inf and not known
            if self.infeasible:
                return
        if known:
            self.layout = known[0].points

    def _round(self, pairs: PairTree, proposals: Proposals, effort: Effort) -> None:
        work, looked_at, tried = sum(tree.work for tree in pairs.trees), pairs.looked_at, len(proposals.tried)
        left = pairs.round(np.inf, by_size=True)
        effort.boxes(self.cell, sum(tree.work for tree in pairs.trees) - work)
        effort.pairs(self.cell, pairs.looked_at - looked_at)
        if len(self.trees) == 2:
            proposals.look(*left)
        for _ in range(len(proposals.tried) - tried):
            effort.refined(self.cell)

    def weight(self, requirement: Requirement) -> int:
        """How many boxes, or pairs, it may have excluded; 0: the proof does not rest on it."""
        if requirement.kind is Kind.COUPLING:
            return sum(len(first) for pairs in self.pairs.values() for first, _ in pairs.by_ties)
        total = 0
        for index, tree in zip(self.arms, self.trees, strict=True):
            counts = np.bincount(tree.nodes.code, minlength=len(tree.excluder.causes))
            total += int(np.sum(counts[numbers_of(self.whole, index, tree.excluder.causes, requirement)]))
        return total

    def without(self, some: Collection[Requirement]) -> SubsetProof:
        """The proof where some things are no longer asked for, which has still to be run."""
        fewer = replace(self.selection, requirements=self.selection.requirements - set(some))
        rebuilt = any(one.kind in REBUILT for one in some)
        return SubsetProof(self.whole, fewer, None if rebuilt else self)


def _kept(scene: Scene, before: SubsetProof) -> tuple[ArmSolution, ...] | None:
    """What the arms do by themselves, should that pass every check of a cell that asks for less."""
    alone = [tree.alone for tree in before.trees]
    points = tuple(one.point for one in alone if one is not None)
    return points if len(points) == len(alone) and clean(scene, points) else None


def _translation(old: Causes, new: Causes) -> Ints:
    """(C,) number of every old cause among the new ones; 0 where it is none of them any more."""
    numbers = {(cause.kind, cause.joint, cause.name): k for k, cause in enumerate(new.all)}
    codes = np.array([numbers.get((cause.kind, cause.joint, cause.name), 0) for cause in old.all], dtype=np.int64)
    codes[BELOW] = 0
    return codes


def numbers_of(cell: Cell, arm: int, causes: Causes, requirement: Requirement) -> list[int]:
    """Numbers of the causes of one arm that may rest on a requirement: without it, their boxes are open again."""
    kind, index = requirement.kind, requirement.index
    match kind:
        case Kind.OBSTACLE:
            name = cell.surroundings.obstacles[index].name
            return [YAW, *(k for k, c in enumerate(causes.all) if c.kind == "obstacle" and c.name == name)]
        case Kind.PART | Kind.SELF:
            word = "part" if kind is Kind.PART else "self"
            return [YAW, *(k for k, c in enumerate(causes.all) if c.kind == word)]
        case Kind.FLOOR:
            return [YAW, FLOOR]
        case Kind.STEP:
            return [YAW, *_of_joints(range(JOINTS), (0, WITH_OTHERS))]
        case _ if index != arm:
            return []
        case Kind.CONDITIONING | Kind.LINEAR:
            return [CONDITIONING if kind is Kind.CONDITIONING else LINEAR]
        case Kind.SINGULARITIES:
            return _of_joints((WITH_OTHERS,), (WITH_OTHERS,))
        case Kind.LIMITS if requirement.joint == 0:
            return [YAW, LINEAR, *_of_joints((0,), (0,))]
        case Kind.LIMITS:
            joints = sorted({requirement.joint, WITH_OTHERS})
            return [LINEAR, *_of_joints(joints, joints)]
        case _:
            return []


def _of_joints(paths: Sequence[int], limits: Sequence[int]) -> list[int]:
    """Causes that joints give by their paths and limits, and the singularity, whose bound knows of the same joints."""
    return [SINGULARITY, *(LIMITS + JOINTS + joint for joint in paths), *(LIMITS + joint for joint in limits)]
