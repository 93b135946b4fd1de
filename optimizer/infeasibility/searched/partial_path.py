"""From a path through some of the poses to one through as many as possible, from the same base on the same branch."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.path_samples import ObjectPath, follow
from duocell.optimizer.nlp.program import ArmSolution

CUTS = 2, 8
"""Steps in which an arm follows the part from a pose to the next: at first, and where that fails."""


@dataclass(frozen=True, eq=False, slots=True)
class PartialPath:
    """One arm of a layout.

    Attributes:
        point: base, and joints (m, n) rad of which those from pose ``first`` to ``last`` mean something.
        first: pose. last: pose, included.
        lost: poses next to these that the arm does not get to from there; without any, it gets to all.
    """

    point: ArmSolution
    first: int
    last: int
    lost: tuple[int, ...]

    def between(self, first: int, last: int) -> ArmSolution:
        """The same base with the joints from one pose to another, both included; a single one is held for two."""
        rows = np.arange(first, last + 1) if first < last else np.array([first, first])
        return replace(self.point, joints=self.point.joints[rows])


def extended(cell: Cell, arm: Arm, point: ArmSolution, first: int, last: int) -> PartialPath:
    """Follow the part outwards, on from the end of a segment to the start of the next as if it were one way.

    Args:
        cell: the whole task. arm: one of its arms.
        point: joints at the poses from ``first`` to ``last``; for a single pose any number of equal rows.
    """
    m = len(cell.task)
    joints: Floats = np.zeros((m, arm.dof))
    joints[first : last + 1] = point.joints[: last - first + 1]
    path = ObjectPath(cell.task.poses)
    base = arm.base_in_world(point.position, point.yaw)
    lost = []
    for step in (1, -1):
        pose = last if step > 0 else first
        while 0 <= pose + step < m:
            grasp = cell.grasps(arm)[pose + step]
            tries = (_next(path, arm, base, joints[pose], pose, grasp, step, cuts) for cuts in CUTS)
            q = next((found for found in tries if found is not None), None)
            if q is None:
                lost.append(pose + step)
                break
            pose += step
            joints[pose] = q
        first, last = (first, pose) if step > 0 else (pose, last)
    return PartialPath(ArmSolution(point.position, point.yaw, joints, point.signs), first, last, tuple(lost))


def _next(
    path: ObjectPath, arm: Arm, base: Floats, joints: Floats, pose: int, grasp: Floats, step: int, cuts: int
) -> Floats | None:
    """Joints (n,) one pose further; None if the arm cannot follow."""
    before = pose if step > 0 else pose - 1
    for cut in range(1, cuts + 1):
        share = cut / cuts if step > 0 else 1.0 - cut / cuts
        flange = path.at(np.array([before]), np.array([share])) @ grasp @ inverse(arm.tool)
        found, good = follow(arm.robot, base, flange, joints[None], joints[None])
        if not good[0]:
            return None
        joints = found[0]
    return joints
