"""Best first over pairs of boxes of two arms, from the roots of their trees."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE
from duocell.optimizer.certificate.pairs.bearing_cost import bearing_cost
from duocell.optimizer.certificate.pairs.contact import Contact
from duocell.optimizer.certificate.pairs.couplings import untied
from duocell.optimizer.certificate.pairs.mirrored_yaw import BestYaw, mirrored_cost
from duocell.optimizer.certificate.pairs.shared_yaw import SharedYaw
from duocell.optimizer.certificate.pairs.store import PairStore
from duocell.optimizer.certificate.pairs.tied_bounds import TiedBounds
from duocell.optimizer.certificate.pairs.ties import mirrored_yaws
from duocell.optimizer.verification.scene import Scene

SMALLEST = 1e-5
"""m; pairs of boxes with no longer half sides are not cut any more."""
BATCH = 256
"""Pairs looked at in a round."""


class PairTree:
    """Pairs of boxes that may still hold something better than what is known.

    Attributes:
        trees: of the two arms; their boxes are bounded and tested as pairs ask for them.
        arms: indices of the two. first, second: (Q,) numbers of boxes. bound: (Q,) no layout of a pair costs less.
        looked_at: pairs so far. untied, apart: of these, lost by couplings, and by contact of the arms.
        forgotten: smallest bound of pairs that are not cut any more.
        by_boxes, by_ties: pairs of numbers that were lost because one box is excluded by itself, and by couplings.
    """

    def __init__(self, scene: Scene, trees: tuple[ArmTree, ArmTree], arms: tuple[int, int]) -> None:
        """Start from the roots; both trees must know what their leaves know (`Nodes.settle`)."""
        self.couplings, self.trees, self.arms = scene.cell.couplings, trees, arms
        self.stores = PairStore.of(trees[0]), PairStore.of(trees[1])
        self.tied = TiedBounds(self.couplings, arms, trees)
        self.shared = [SharedYaw(total, self.stores) for total in mirrored_yaws(self.couplings, arms)]
        self.contact = Contact.of(*self.stores, scene.model, scene.required)
        self.by_boxes: list[tuple[Ints, Ints]] = []
        self.by_ties: list[tuple[Ints, Ints]] = []
        self.forgotten = np.inf
        self.looked_at = self.untied = self.apart = 0
        one, other = trees[0].nodes.roots, trees[1].nodes.roots
        self._start(np.repeat(one, len(other)), np.tile(other, len(one)))

    def _start(self, first: Ints, second: Ints) -> None:
        """Put pairs on the list, those that no box excludes by itself."""
        alive = self._alive(first, second)
        self.by_boxes.append((first[~alive], second[~alive]))
        self.first, self.second = first[alive], second[alive]
        self.bound = self._sums(self.first, self.second)

    def _alive(self, first: Ints, second: Ints) -> Bools:
        """(P,) True for pairs of which neither box is excluded by itself."""
        nodes = self.trees[0].nodes, self.trees[1].nodes
        found: Bools = (nodes[0].code[first] == 0) & (nodes[1].code[second] == 0)
        return found

    def reopened(self, scene: Scene, trees: tuple[ArmTree, ArmTree]) -> PairTree:
        """The same pairs where less is asked for: what boxes or couplings excluded is to be looked at again.

        Args:
            scene: of a cell that asks for less of the same arms, but for the same contact of the two.
            trees: of its arms, which have the boxes of these (`Nodes.translated`).
        """
        new = PairTree(scene, trees, self.arms)
        for store, old in zip(new.stores, self.stores, strict=True):
            store.take_over(old)
        again = [(self.first, self.second), *self.by_boxes]
        if scene.cell.couplings != self.couplings:
            again += self.by_ties
        else:
            new.by_ties = list(self.by_ties)
        new.by_boxes = []
        new._start(np.concatenate([pair[0] for pair in again]), np.concatenate([pair[1] for pair in again]))
        return new

    @property
    def lower(self) -> float:
        """No layout of the two arms costs less; inf if there is none."""
        return min(float(np.min(self.bound, initial=np.inf)), self.forgotten)

    def drop(self, cutoff: float) -> None:
        """Forget the pairs whose bound is good enough."""
        done = self.bound >= cutoff
        self.forgotten = min(self.forgotten, float(np.min(self.bound[done], initial=np.inf)))
        self.first, self.second, self.bound = self.first[~done], self.second[~done], self.bound[~done]

    def round(self, cutoff: float, by_size: bool = False) -> tuple[Ints, Ints]:
        """Look at some pairs and cut those that are left.

        Args:
            cutoff: bounds from here on are good enough.
            by_size: largest first in place of those with the smallest bounds: to exclude everything.

        Returns:
            Numbers of boxes of the pairs that nothing excludes, best first.
        """
        self.drop(cutoff)
        first, second, bound = self._taken(by_size)
        self.looked_at += len(first)
        least = [float(np.min(tree.nodes.bound[tree.nodes.roots], initial=np.inf)) for tree in self.trees]
        for tree, ids, other in ((self.trees[0], first, least[1]), (self.trees[1], second, least[0])):
            new = np.unique(ids[tree.nodes.children[ids, 0] < 0])  # others know what their halves know
            tree.evaluate(new, cutoff - other, search=False)
        bound = np.maximum(bound, self._sums(first, second))
        kept = self._kept(first, second, bound, cutoff)
        first, second, bound = first[kept], second[kept], bound[kept]
        order = np.argsort(bound, kind="stable")
        self._cut(first, second, bound, by_size)
        return first[order], second[order]

    def _taken(self, by_size: bool) -> tuple[Ints, Ints, Floats]:
        """The next pairs, taken off the list."""
        key = self.bound
        if by_size:
            key = -np.maximum(self.trees[0].nodes.size[self.first], self.trees[1].nodes.size[self.second])
        chosen = np.zeros(len(key), dtype=np.bool_)
        count = min(BATCH, len(key))
        if count:
            chosen[np.argsort(key, kind="stable")[:count]] = True
        taken = self.first[chosen], self.second[chosen], self.bound[chosen]
        self.first, self.second, self.bound = self.first[~chosen], self.second[~chosen], self.bound[~chosen]
        return taken

    def _sums(self, first: Ints, second: Ints) -> Floats:
        """(P,) sums of the bounds of both boxes."""
        sums: Floats = self.trees[0].nodes.bound[first] + self.trees[1].nodes.bound[second]
        return sums

    def _kept(self, first: Ints, second: Ints, bound: Floats, cutoff: float) -> Bools:
        """(P,) False for pairs that hold nothing better; raises ``bound`` (P,) where it can."""
        nodes = self.trees[0].nodes, self.trees[1].nodes
        kept: Bools = np.isfinite(bound) & self._alive(first, second)
        self.by_boxes.append((first[~kept], second[~kept]))
        boxes = nodes[0].boxes(first), nodes[1].boxes(second)
        lost = kept & untied(self.couplings, self.arms, *boxes)
        self.by_ties.append((first[lost], second[lost]))
        self.untied += int(np.sum(lost))
        kept &= ~lost
        self.bound_ties(first, second, bound, kept, cutoff)
        good = kept & (bound >= cutoff)
        self.forgotten = min(self.forgotten, float(np.min(bound[good], initial=np.inf)))
        kept &= ~good
        left = np.flatnonzero(kept)
        apart = self.contact.slack(first[left], second[left]) < -TOLERANCE
        self.apart += int(np.sum(apart))
        kept[left[apart]] = False
        return kept

    def bound_ties(self, first: Ints, second: Ints, bound: Floats, kept: Bools, cutoff: float) -> None:
        """Raise the bounds (P,) of kept pairs by what couplings cost."""
        bounded = self.trees[0].nodes.bounded[first] & self.trees[1].nodes.bounded[second]
        rows = np.flatnonzero(kept & bounded)
        if not self.tied.useful or not len(rows):
            return
        yaws = self._yaws(first[rows], second[rows])
        geometric = self.trees[0].nodes.geometric[first[rows]] + self.trees[1].nodes.geometric[second[rows]]
        boxes = self.trees[0].nodes.boxes(first[rows]), self.trees[1].nodes.boxes(second[rows])
        turned = np.maximum(
            mirrored_cost(self.couplings, self.arms, *yaws), bearing_cost(self.couplings, self.arms, boxes, yaws)
        )
        bound[rows] = np.maximum(bound[rows], geometric + turned)
        left = np.flatnonzero(bound[rows] < cutoff)
        if len(left) and np.isfinite(cutoff):
            some = rows[left]
            bound[some] = np.fmax(bound[some], self.tied(first[some], second[some], (yaws[0][left], yaws[1][left])))
        for shared in self.shared:
            left = np.flatnonzero(bound[rows] < cutoff)
            some = rows[left]
            if len(left):
                bound[some] = np.maximum(bound[some], geometric[left] + shared.cost(first[some], second[some]))

    def _yaws(self, first: Ints, second: Ints) -> tuple[BestYaw, BestYaw]:
        """Best yaws over the boxes of pairs (P,)."""
        one, other = (store.places(ids) for store, ids in zip(self.stores, (first, second), strict=True))
        return self.stores[0].yaw[one], self.stores[1].yaw[other]

    def _cut(self, first: Ints, second: Ints, bound: Floats, by_size: bool) -> None:
        """Cut one box of each pair: the larger one; to exclude everything rather one that has been cut already."""
        nodes = self.trees[0].nodes, self.trees[1].nodes
        sizes = nodes[0].size[first], nodes[1].size[second]
        small = np.maximum(*sizes) <= SMALLEST
        self.forgotten = min(self.forgotten, float(np.min(bound[small], initial=np.inf)))
        first, second, bound = first[~small], second[~small], bound[~small]
        cut = nodes[0].children[first, 0] >= 0, nodes[1].children[second, 0] >= 0
        one = sizes[0][~small] >= sizes[1][~small]
        if by_size:
            one = np.where(cut[0] != cut[1], cut[0], one)
        nodes[0].split(first[one])
        nodes[1].split(second[~one])
        halves = nodes[0].children[first[one]].ravel(), nodes[1].children[second[~one]].ravel()
        ones = np.concatenate([halves[0], np.repeat(first[~one], 2)])
        others = np.concatenate([np.repeat(second[one], 2), halves[1]])
        inherited = np.concatenate([np.repeat(bound[one], 2), np.repeat(bound[~one], 2)])
        bounds = np.maximum(inherited, self._sums(ones, others))
        alive = np.isfinite(bounds) & self._alive(ones, others)
        self.by_boxes.append((ones[~alive], others[~alive]))
        self.first = np.concatenate([self.first, ones[alive]])
        self.second = np.concatenate([self.second, others[alive]])
        self.bound = np.concatenate([self.bound, bounds[alive]])
