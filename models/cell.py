"""A cell: one task and the arms that carry it out together."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

from models.arm import Arm
from models.arrays import Floats
from models.coupling import Coupling
from models.pose import inverse
from models.surroundings import Surroundings
from models.task import Task

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
    """

    task: Task
    arms: tuple[Arm, ...]
    max_joint_step: float = DEFAULT_MAX_JOINT_STEP
    name: str = ""
    surroundings: Surroundings = field(default_factory=Surroundings)
    couplings: tuple[Coupling, ...] = ()

    @property
    def coupled(self) -> bool:
        """True if anything but the arms' own task and region decides where they may stand."""
        return bool(self.couplings) or self.surroundings.floor is not None or self.surroundings.clearances.any

    def flange_targets(self, arm: Arm) -> Floats:
        """(m, 4, 4) poses in the world that the flange of ``arm`` has to take: T_W^C T_C^H (T_flange^tcp)^-1."""
        targets: Floats = self.task.poses @ arm.grasp @ inverse(arm.tool)
        return targets
