"""The layouts on which every arm is on its task: their unknowns, their directions, and the way back onto them.

A layout has four unknowns per arm, its base, and for redundant arms one more per pose and redundant joint, its motion
in the nullspace of the Jacobian. All joints follow from these to first order by the Jacobian; `on_task` does the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.cell.pose_freedom import EQUATIONS
from duocell.models.kinematics.batch_kinematics import forward_and_jacobian
from duocell.models.kinematics.chain import chain_of
from duocell.models.robot.arm import Arm
from duocell.optimizer.nlp.pose_rows import BASE
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.on_task import REACHED, brought_onto
from duocell.optimizer.sqp.sensitivity import joints_by_base


@dataclass(frozen=True, slots=True)
class Unknowns:
    """Where the unknowns of a layout are: four per base, then those of redundant arms in the nullspace, pose by pose.

    Attributes:
        nullspace: per arm, unknowns per pose. first_nullspace: per arm, the place of the first. count: of all unknowns.
    """

    nullspace: tuple[int, ...]
    first_nullspace: tuple[int, ...]
    count: int

    @staticmethod
    def of(cell: Cell) -> Unknowns:
        """The unknowns of a cell."""
        nullspace = tuple(cell.freedom(arm).nullspace(arm.dof) for arm in cell.arms)
        first, count = [], BASE * len(cell.arms)
        for size in nullspace:
            first.append(count)
            count += size * len(cell.task)
        return Unknowns(nullspace, tuple(first), count)

    def base(self, arm: int) -> slice:
        """Unknowns of one arm's base."""
        return slice(BASE * arm, BASE * (arm + 1))

    def own(self, arm: int, poses: int) -> Ints:
        """Indices of all unknowns of one arm."""
        first = self.first_nullspace[arm]
        return np.concatenate(
            [np.arange(BASE * arm, BASE * (arm + 1)), np.arange(first, first + self.nullspace[arm] * poses)]
        )


@dataclass(frozen=True, eq=False, slots=True)
class Directions:
    """How the joints of one arm move with its unknowns, at K places on the path.

    Attributes:
        by_base: (K, n, 4) rad per unknown of the base.
        by_nullspace: (K, n, d) rad, unit motions that leave the hand at rest.
    """

    by_base: Floats
    by_nullspace: Floats


def directions(arm: Arm, rotation: Floats, joints: Floats) -> Directions:
    """Directions at joint values (K, n) rad; ``rotation`` (3, 3) or (K, 3, 3) are the base's axes in the world."""
    by_base = joints_by_base(arm.robot, rotation, joints)
    nullspace = arm.dof - EQUATIONS
    if nullspace == 0:
        return Directions(by_base, np.zeros((*joints.shape, 0)))
    _, _, jacobians = forward_and_jacobian(chain_of(arm.robot), joints)
    _, _, rows = np.linalg.svd(jacobians)
    return Directions(by_base, rows[:, EQUATIONS:].swapaxes(1, 2))


def move(
    cell: Cell, points: Sequence[ArmSolution], along: Sequence[Directions], unknowns: Unknowns, step: Floats
) -> tuple[tuple[ArmSolution, ...], float]:
    """The layout a step away, with every arm exactly on its task; and by how many m some arm misses it.

    Args:
        cell: the cell. points: one per arm. along: directions at their poses. unknowns: of the cell.
        step: (C,) change of the unknowns.
    """
    moved, most = [], 0.0
    for a, (arm, point, tangents) in enumerate(zip(cell.arms, points, along, strict=True)):
        base = step[unknowns.base(a)]
        q = point.joints + tangents.by_base @ base
        first, nullspace = unknowns.first_nullspace[a], unknowns.nullspace[a]
        if nullspace:
            q = q + np.einsum(
                "mnd,md->mn", tangents.by_nullspace, step[first : first + nullspace * len(q)].reshape(-1, nullspace)
            )
        position, yaw = point.position + base[:3], point.yaw + float(base[3])
        base_there = arm.base_in_world(position, yaw)
        targets = cell.flange_targets(arm, point.free)
        found, missing = brought_onto(arm, point.signs, base_there, targets, point.joints, q)
        most = max(most, float(np.max(missing)))
        moved.append(ArmSolution(position, yaw, found, point.signs, point.free))
    return tuple(moved), most if most >= REACHED else 0.0
