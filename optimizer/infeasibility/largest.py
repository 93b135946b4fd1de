"""The largest clearance or conditioning that an arm can keep by itself: one tree, whose level rises with what is found.

The tree is that of the arm where no more than contact is to be avoided. A box is excluded where no base in it keeps
more than the best that was met at the centre of a box, by a small amount; when all boxes are, the best is known as
exactly as that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.certificate.arm_tree import USABLE, AloneLayout, ArmTree
from duocell.optimizer.certificate.exclusion.causes import CONDITIONING
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed, reduced_problem
from duocell.optimizer.verification.scene import Scene

BOXES = 4000
"""Bounded at most."""
LOOKED_AT = 6
"""Places per round that are measured."""
KINDS = {PairClass.ARM_OBSTACLE: "obstacle", PairClass.ARM_PART: "part", PairClass.SELF: "self"}


@dataclass(frozen=True, eq=False, slots=True)
class Largest:
    """How much an arm can keep.

    Attributes:
        found: kept by ``point`` at all poses; None where nothing was found.
        bound: no layout keeps more; -inf if the arm has no layout at all; inf where nothing was proved.
        point: of the arm.
    """

    found: float | None
    bound: float
    point: ArmSolution | None


def largest_clearance(cell: Cell, index: int, kind: PairClass, precise: float, effort: Effort) -> Largest | None:
    """The largest clearance [m] of a class that an arm can keep, the rest of its cell being kept; None without a tree.

    Args:
        cell: that asks for nothing but contact to be avoided in the class. index: of the arm.
        kind: arm_obstacle, arm_part or self. precise: m. effort: that may be spent.
    """
    problem = reduced_problem(cell, cell.arms[index])
    if problem is None or kind not in KINDS:
        return None
    tree = _Rising(Scene.of(cell), index, problem, _Clearance(kind), precise)
    soft = [c for c, cause in enumerate(tree.excluder.causes.all) if cause.kind == KINDS[kind]]
    return tree.run(soft, effort)


def largest_conditioning(cell: Cell, index: int, precise: float, effort: Effort) -> Largest | None:
    """The same for the conditioning of a cell that asks for nearly none of the arm."""
    arm = cell.arms[index]
    problem = reduced_problem(cell, arm)
    if problem is None:
        return None
    tree = _Rising(Scene.of(cell), index, problem, _Conditioning(arm), precise)
    return tree.run([CONDITIONING], effort)


class _Clearance:
    """Smallest distance of a class at the poses."""

    def __init__(self, kind: PairClass) -> None:
        self.kind = kind

    def __call__(self, scene: Scene, point: ArmSolution) -> float:
        model, task = scene.model, scene.cell.task
        if model is None:
            return np.inf
        places = model.configure(scene.bases([point]), [point.joints], task.poses, task.segment_of)
        found = model.closest(places, self.kind)
        return np.inf if found is None else found[1].distance


class _Conditioning:
    """Smallest conditioning at the poses, beyond the little that is asked for."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm

    def __call__(self, scene: Scene, point: ArmSolution) -> float:
        arm = self.arm
        values = conditioning_of(chain_of(arm.robot), arm.tool, point.joints, characteristic_length(arm.robot))
        return float(np.min(values)) - (arm.min_conditioning or 0.0)


class _Rising(ArmTree):
    """A tree whose level rises with the best slack that is met."""

    def __init__(
        self,
        scene: Scene,
        index: int,
        problem: ReducedProblem,
        slack: _Clearance | _Conditioning,
        precise: float,
    ) -> None:
        super().__init__(scene, index, problem)
        self.slack, self.precise = slack, precise
        self.best = -np.inf
        self.point: ArmSolution | None = None
        self.soft: list[int] = []

    def run(self, soft: list[int], effort: Effort) -> Largest:
        """Work the tree off; ``soft`` are the numbers of the causes in question."""
        self.soft = soft
        while not self.empty and self.boxes < BOXES and not effort.over:
            check_stop()
            before, more = self.work, self.work_off(np.inf, by_size=True)
            effort.boxes(self.check.scene.cell, self.work - before)
            if not more:
                break
        bound = self.best + self.precise if self.empty else np.inf  # -inf where nothing was found at all
        return Largest(self.best if np.isfinite(self.best) else None, bound, self.point)

    def _try(self, places: Floats, postures: Ints) -> None:
        """Measure usable layouts at some places (n, 3) in postures (n,)."""
        paths = evaluate_signed(self.problem, places, np.array(ALL_SIGNS)[postures])
        for k in np.flatnonzero(paths.violation[0] <= USABLE)[:LOOKED_AT]:
            point = ArmSolution(places[k], float(paths.yaw[0, k]), paths.joints[:, 0, k].T, ALL_SIGNS[postures[k]])
            slack = self.slack(self.check.scene, point)
            if slack > max(self.best, 0.0) and self.check.usable(point):
                self.best, self.point = slack, point
                self.alone = AloneLayout(point, 0.0)
                self.levels = dict.fromkeys(self.soft, slack + self.precise)
