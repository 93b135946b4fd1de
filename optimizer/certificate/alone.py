"""Layouts of one arm by itself among the surroundings of its cell: does it keep all that is not of other arms?"""

from __future__ import annotations

from dataclasses import dataclass

from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.scene import Scene, alone_scene, own_violations
from duocell.optimizer.verification.verify import check


@dataclass(frozen=True, eq=False, slots=True)
class AloneCheck:
    """One arm of a cell; ``scene`` is its own, without the others."""

    cell: Cell
    arm: Arm
    scene: Scene

    @staticmethod
    def of(cell: Cell, arm: Arm) -> AloneCheck:
        """The check of one arm."""
        return AloneCheck(cell, arm, alone_scene(cell, arm))

    def usable(self, point: ArmSolution) -> bool:
        """True if a layout holds at the poses: task, limits, floor, surroundings."""
        return self.nearly(point, 0.0)

    def nearly(self, point: ArmSolution, violation: float) -> bool:
        """True if a layout keeps its task and limits at the poses, and the others up to a violation [m]."""
        return own_violations(self.scene, [point])[0] <= violation and check(self.cell, self.arm, point).usable
