"""A cell: one task, or a task sequence, and the arms that carry it out together."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import pi

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import inverse
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.surroundings import Surroundings
from duocell.models.cell.task import Task
from duocell.models.robot.arm import Arm

DEFAULT_MAX_JOINT_STEP = pi / 2


@dataclass(frozen=True, eq=False)
class Cell:
    """What is to be laid out.

    Attributes:
        task: object poses.
        arms: one or more, names unique.
        max_joint_step: rad, largest change of any joint between consecutive poses; at most π, so that no step can
            hide a 2π jump.
        name: label given by the user.
        surroundings: obstacles, part, floor, equipment of the arms, and the distances to keep.
        couplings: ties between the bases.

    Raises:
        InvalidInput: two arms have the same name; answers could not tell them apart.
    """

    task: Task
    arms: tuple[Arm, ...]
    max_joint_step: float = DEFAULT_MAX_JOINT_STEP
    name: str = ""
    surroundings: Surroundings = field(default_factory=Surroundings)
    couplings: tuple[Coupling, ...] = ()

    def __post_init__(self) -> None:
        names = [arm.name for arm in self.arms]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise InvalidInput(
                    f"another arm is called {name!r} too; names must be unique. Rename one of them.",
                    f"/arms/{index}/name",
                )
        for arm in self.arms:
            if arm.grasps is not None and len(arm.grasps) != len(self.task.starts):
                raise ValueError(f"{arm.name} has {len(arm.grasps)} grasps for {len(self.task.starts)} jobs")

    @property
    def coupled(self) -> bool:
        """True if anything but the arms' own task and region decides where they may stand."""
        return bool(self.couplings) or self.surroundings.floor is not None or self.surroundings.clearances.any

    def grasps(self, arm: Arm) -> Floats:
        """(m, 4, 4) TCP of ``arm`` in the object frame at every pose."""
        if arm.grasps is not None:
            grasps: Floats = arm.grasps[self.task.segment_of]
            return grasps
        return np.broadcast_to(arm.grasp, self.task.poses.shape)

    def flange_targets(self, arm: Arm) -> Floats:
        """(m, 4, 4) poses in the world that the flange of ``arm`` has to take: T_W^C T_C^H (T_flange^tcp)^-1."""
        targets: Floats = self.task.poses @ self.grasps(arm) @ inverse(arm.tool)
        return targets

    def alone(self, segment: int) -> Cell:
        """The same cell with one segment of the task only."""
        return replace(self, task=self.task.alone(segment), arms=tuple(arm.in_segment(segment) for arm in self.arms))

    def part(self, first: int, last: int) -> Cell:
        """The same cell with the poses from ``first`` to ``last`` only, both included; a single one is held for two."""
        segments = slice(int(self.task.segment_of[first]), int(self.task.segment_of[last]) + 1)
        arms = (arm if arm.grasps is None else replace(arm, grasps=arm.grasps[segments]) for arm in self.arms)
        return replace(self, task=self.task.part(first, last), arms=tuple(arms))
