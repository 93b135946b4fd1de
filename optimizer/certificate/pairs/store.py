"""What the contact of two arms needs to know of boxes, kept by their number."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.exclusion.motion import Motion
from duocell.optimizer.certificate.pairs.mirrored_yaw import BestYaw, best_yaw

POSES = 32
"""Poses at which two arms are kept apart in long tasks, evenly along the way: fewer exclude less, never wrongly."""
AT_ONCE = 4000
"""Poses times boxes placed at once."""


@dataclass(eq=False, slots=True)
class PairStore:
    """One arm's boxes, as pairs of arms see them.

    Attributes:
        tree: of the arm. poses: (k,) indices of the poses that are looked at.
        slots: number of a box -> its place in what is kept.
        motion: over the boxes that are kept, in slots. ends: (S, k, C, 2, 3) m of the arm's capsules at their centres.
        yaw: best yaws over them.
    """

    tree: ArmTree
    poses: Ints
    slots: dict[int, int] = field(default_factory=dict)
    motion: Motion | None = None
    ends: Floats = field(default_factory=lambda: np.zeros((0, 0, 0, 2, 3)))
    yaw: BestYaw = field(default_factory=lambda: BestYaw(np.zeros(0), np.zeros(0), 0.0, np.zeros(0)))

    @staticmethod
    def of(tree: ArmTree) -> PairStore:
        """An empty store of a tree."""
        m = len(tree.problem.positions)
        return PairStore(tree, np.unique(np.linspace(0, m - 1, min(m, POSES)).round().astype(np.int64)))

    def places(self, ids: Ints) -> Ints:
        """Slots of boxes, placed where they have not been yet."""
        new = np.array([i for i in np.unique(ids) if int(i) not in self.slots], dtype=np.int64)
        step = max(AT_ONCE // len(self.tree.problem.positions), 1)
        parts = [self._placed(new[at : at + step]) for at in range(0, len(new), step)]
        if parts:
            before = [] if self.motion is None else [self.motion]
            start = len(self.slots)
            self.motion = Motion.joined([*before, *(part for part, _, _ in parts)])
            self.ends = np.concatenate([*([self.ends] if before else []), *(ends for _, ends, _ in parts)])
            yaws = [*([self.yaw] if before else []), *(yaw for _, _, yaw in parts)]
            best, radius, paid = (
                np.concatenate([getattr(y, name) for y in yaws]) for name in ("yaw", "radius", "paid")
            )
            self.yaw = BestYaw(best, radius, yaws[-1].weight, paid)
            self.slots.update({int(i): start + k for k, i in enumerate(new)})
        return np.array([self.slots[int(i)] for i in ids], dtype=np.int64)

    def take_over(self, other: PairStore) -> None:
        """What another store knows of the same boxes of the same arm."""
        mine, others = (store.tree.excluder.bodies.capsules for store in (self, other))
        if np.array_equal(mine.link, others.link) and np.array_equal(mine.ends, others.ends):
            self.slots, self.motion, self.ends, self.yaw = dict(other.slots), other.motion, other.ends, other.yaw

    def _placed(self, ids: Ints) -> tuple[Motion, Floats, BestYaw]:
        excluder = self.tree.excluder
        moved = excluder.moved(self.tree.nodes.boxes(ids))
        yaw = best_yaw(moved.first, excluder.rules, self.tree.problem.sigma)
        some = moved.at_poses(self.poses)
        return some, excluder.bodies.capsules.placed(some.frames), yaw
