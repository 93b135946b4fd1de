"""A cell: one task, or a task sequence, and the arms that carry it out together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import inf, pi

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import inverse
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.pose_freedom import PoseFreedom, pose_freedom
from duocell.models.cell.surroundings import Surroundings
from duocell.models.cell.task import Task
from duocell.models.objective.objective import JOINT_AVAILABILITY, Objective
from duocell.models.robot.arm import Arm
from duocell.models.robot.robot import Robot

DEFAULT_MAX_JOINT_STEP = pi / 2


@dataclass(frozen=True, eq=False)
class Cell:
    """What is to be laid out.

    Attributes:
        task: object poses.
        arms: one or more, names unique.
        max_joint_step: rad, largest change of any revolute joint between consecutive poses; at most π, so that no
            step can hide a 2π jump.
        name: label given by the user.
        surroundings: obstacles, part, floor, equipment of the arms, and the distances to keep.
        couplings: ties between the bases.
        max_prismatic_step: m, the same of prismatic joints; infinite: as far as they go.
        objective: what the layout is to be best at.

    Raises:
        InvalidInput: two arms have the same name, so that answers could not tell them apart; or a coupling ties arms
            that it cannot.
    """

    task: Task
    arms: tuple[Arm, ...]
    max_joint_step: float = DEFAULT_MAX_JOINT_STEP
    name: str = ""
    surroundings: Surroundings = field(default_factory=Surroundings)
    couplings: tuple[Coupling, ...] = ()
    max_prismatic_step: float = inf
    objective: Objective = JOINT_AVAILABILITY

    def __post_init__(self) -> None:
        names = [arm.name for arm in self.arms]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise InvalidInput(
                    f"another arm is called {name!r} too; names must be unique. Rename one of them.",
                    f"/arms/{index}/name",
                )
        for index, coupling in enumerate(self.couplings):
            try:
                coupling.check(self.arms)
            except InvalidInput as refused:
                raise InvalidInput(refused.detail, f"/coupling/{index}{refused.pointer}") from refused
        for arm in self.arms:
            if arm.grasps is not None and len(arm.grasps) != len(self.task.starts):
                raise ValueError(f"{arm.name} has {len(arm.grasps)} grasps for {len(self.task.starts)} jobs")
            if arm.freedom is not None and len(arm.freedom) != len(self.task):
                raise ValueError(f"{arm.name} has freedoms of {len(arm.freedom)} poses for {len(self.task)}")

    @property
    def coupled(self) -> bool:
        """True if anything but the arms' own task and region decides where they may stand."""
        return bool(self.couplings) or self.surroundings.floor is not None or self.surroundings.clearances.any

    def freedom(self, arm: Arm) -> PoseFreedom:
        """What the poses ask of ``arm``, and what they leave open."""
        return _freedom_of(self, arm)

    def held(self, arm: Arm) -> Floats:
        """(m, 4, 4) TCP of ``arm`` in the object frame at every pose, without any displacement."""
        if arm.grasps is not None:
            grasps: Floats = arm.grasps[self.task.segment_of]
            return grasps
        return np.broadcast_to(arm.grasp, self.task.poses.shape)

    def grasps(self, arm: Arm, values: Floats | None = None) -> Floats:
        """(m, 4, 4) TCP of ``arm`` in the object frame at every pose; ``values`` as for `flange_targets`."""
        if arm.freedom is None:
            return self.held(arm)
        grasps: Floats = inverse(self.task.poses) @ self.flange_targets(arm, values) @ arm.tool
        return grasps

    def flange_targets(self, arm: Arm, values: Floats | None = None) -> Floats:
        """(m, 4, 4) poses in the world that the flange of ``arm`` has to take: T_W^C T_C^H (T_flange^tcp)^-1.

        ``values`` (m, k) m and rad are of the parameters that `freedom` leaves open, nominal without any.
        """
        if arm.freedom is None:
            targets: Floats = self.task.poses @ self.held(arm) @ inverse(arm.tool)
            return targets
        return self.freedom(arm).targets(values)

    def step_limits(self, robot: Robot) -> Floats:
        """(n,) rad or m, largest change of each joint between consecutive poses."""
        return np.where(robot.prismatic, self.max_prismatic_step, self.max_joint_step)

    def with_parameters(self, values: Sequence[Floats | None]) -> Cell:
        """The same cell with what its poses leave open given, where there are values: (m, k) per arm."""
        arms = []
        for given, own in zip(self.arms, values, strict=True):
            arm, asked = given, self.freedom(given)
            if arm.freedom is not None and own is not None and not asked.exact:
                arm = replace(arm, freedom=arm.freedom.fixed(asked.all_values(own)))
            arms.append(arm)
        changed = any(one is not other for one, other in zip(arms, self.arms, strict=True))
        return replace(self, arms=tuple(arms)) if changed else self

    def with_task(self, task: Task, rows: Ints) -> Cell:
        """The same cell with another task, whose poses are in place of these ones (their numbers)."""
        return replace(self, task=task, arms=tuple(_with_rows(arm, rows) for arm in self.arms))

    def with_places(self, task: Task, rows: Ints, steps: Ints, fractions: Floats) -> Cell:
        """The same cell with a longer task: its own poses are at ``rows``, the others at fractions of ``steps``."""
        arms = tuple(
            arm if arm.freedom is None else replace(arm, freedom=arm.freedom.with_places(rows, steps, fractions))
            for arm in self.arms
        )
        return replace(self, task=task, arms=arms)

    def alone(self, segment: int) -> Cell:
        """The same cell with one segment of the task only."""
        rows = np.arange(*self.task.segments[segment].indices(len(self.task)))
        arms = tuple(_with_rows(arm.in_segment(segment), rows) for arm in self.arms)
        return replace(self, task=self.task.alone(segment), arms=arms)

    def part(self, first: int, last: int) -> Cell:
        """The same cell with the poses from ``first`` to ``last`` only, both included; a single one is held for two."""
        segments = slice(int(self.task.segment_of[first]), int(self.task.segment_of[last]) + 1)
        arms = (arm if arm.grasps is None else replace(arm, grasps=arm.grasps[segments]) for arm in self.arms)
        rows = np.arange(first, last + 1) if first < last else np.array([first, first])
        return replace(self, task=self.task.part(first, last), arms=tuple(_with_rows(arm, rows) for arm in arms))


@lru_cache(maxsize=32)
def _freedom_of(cell: Cell, arm: Arm) -> PoseFreedom:
    return pose_freedom(cell.task.poses, cell.held(arm), arm.tool, arm.freedom)


def _with_rows(arm: Arm, rows: Ints) -> Arm:
    """The arm for some of the poses."""
    return arm if arm.freedom is None else replace(arm, freedom=arm.freedom.rows(rows))
