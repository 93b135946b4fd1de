"""What a cell asks for, taken apart: requirements that can be left out one by one, and what is left then."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, pi

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, among
from duocell.models.cell.coupling.apart import Apart
from duocell.models.cell.surroundings import Surroundings
from duocell.models.kinematics.nominal import singular_fifth
from duocell.models.robot.arm import FREE_YAW, Arm, Interval
from duocell.models.robot.posture import Posture
from duocell.optimizer.reduction.box import reach_windows


class Kind(StrEnum):
    """Sorts of requirements; where a choice is left, the earlier ones are the first to be left out."""

    SELF = "self-collision"
    STEP = "max_joint_step"
    CONDITIONING = "min_conditioning"
    SINGULARITIES = "singularity rule"
    LINEAR = "linear limit"
    LIMITS = "limits"
    POSTURE = "posture"
    REGION = "base region"
    OBSTACLE = "obstacle"
    PART = "part"
    FLOOR = "floor"
    COUPLING = "coupling"
    ARM = "arm"


OWN = (Kind.STEP, Kind.CONDITIONING, Kind.SINGULARITIES, Kind.LINEAR, Kind.LIMITS, Kind.POSTURE, Kind.REGION)
"""What an arm is asked for whatever stands around it."""
OF_ARMS = (Kind.ARM, Kind.REGION, Kind.POSTURE, Kind.CONDITIONING, Kind.SINGULARITIES, Kind.LINEAR, Kind.LIMITS)
"""What has an index that is that of an arm."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """Something that a cell asks for.

    Attributes:
        kind: its sort. index: of the arm, obstacle or coupling. joint: of limits; of linear limits the number.
    """

    kind: Kind
    index: int = 0
    joint: int = 0

    def words(self, cell: Cell) -> str:
        """Its name for people."""
        match self.kind:
            case Kind.OBSTACLE:
                return f"obstacle {cell.surroundings.obstacles[self.index].name}"
            case Kind.COUPLING:
                coupling = cell.couplings[self.index]
                if isinstance(coupling, Apart):
                    return f"two places for {' and '.join(cell.arms[arm].name for arm in coupling.arms)}"
                return f"coupling {coupling.kind}({', '.join(cell.arms[arm].name for arm in coupling.arms)})"
            case Kind.LIMITS:
                arm = cell.arms[self.index]
                return f"limits of {arm.name} / {arm.robot.joint_names[self.joint]}"
            case Kind.LINEAR:
                arm = cell.arms[self.index]
                return f"linear limit of {arm.name} / {arm.bounded_names[arm.dof + self.joint]}"
            case Kind.ARM:
                return f"arm {cell.arms[self.index].name}"
            case Kind.REGION | Kind.POSTURE | Kind.CONDITIONING | Kind.SINGULARITIES:
                return f"{self.kind} of {cell.arms[self.index].name}"
            case _:
                return str(self.kind)


@dataclass(frozen=True, slots=True)
class Selection:
    """Some requirements of a cell, and the poses from ``first`` to ``last``, both included."""

    requirements: frozenset[Requirement]
    first: int
    last: int

    def without(self, *some: Requirement) -> Selection:
        """The selection without some requirements."""
        return replace(self, requirements=self.requirements - set(some))

    def shorter(self) -> Iterator[Selection]:
        """The selection without its first, and without its last pose; nothing if it has but one."""
        if self.first < self.last:
            yield replace(self, first=self.first + 1)
            yield replace(self, last=self.last - 1)

    def halfway(self, fewer: Selection) -> Selection:
        """Some of the poses that ``fewer`` leaves out at either end."""
        first, last = (self.first + fewer.first) // 2, (self.last + fewer.last + 1) // 2
        return replace(self, first=first, last=last)

    def words(self, cell: Cell) -> tuple[str, ...]:
        """What it holds, for people: arms first (where there are several), then poses, then the rest."""
        poses = f"pose {self.first}" if self.first == self.last else f"poses {self.first}-{self.last}"
        ordered = by_interest(self.requirements)
        arms = [e.words(cell) for e in ordered if e.kind is Kind.ARM and len(cell.arms) > 1]
        return (*arms, poses, *(e.words(cell) for e in ordered if e.kind is not Kind.ARM))


def by_interest(requirements: Iterable[Requirement]) -> list[Requirement]:
    """Elements in the order of `Kind`: the first to be left out first."""
    order = list(Kind)
    return sorted(requirements, key=lambda e: (order.index(e.kind), e.index, e.joint))


def everything(cell: Cell) -> Selection:
    """All requirements and all poses."""
    return Selection(frozenset(_requirements(cell)), 0, len(cell.task) - 1)


def _requirements(cell: Cell) -> Iterator[Requirement]:
    around = cell.surroundings
    for a, arm in enumerate(cell.arms):
        yield Requirement(Kind.ARM, a)
        yield Requirement(Kind.REGION, a)
        if not arm.posture.free:
            yield Requirement(Kind.POSTURE, a)
        if arm.min_conditioning is not None:
            yield Requirement(Kind.CONDITIONING, a)
        if arm.avoid_singularities and singular_fifth(arm.robot) is not None:
            yield Requirement(Kind.SINGULARITIES, a)
        yield from (Requirement(Kind.LINEAR, a, k) for k in range(len(arm.bounded_names) - arm.dof))
        yield from (Requirement(Kind.LIMITS, a, int(j)) for j in np.flatnonzero(np.isfinite(arm.upper - arm.lower)))
    asked = around.clearances
    if asked.arm_obstacle is not None or asked.part_obstacle is not None:
        yield from (Requirement(Kind.OBSTACLE, k) for k in range(len(around.obstacles)))
    if around.part is not None and (asked.arm_part is not None or asked.part_obstacle is not None):
        yield Requirement(Kind.PART)
    if asked.self_collision is not None:
        yield Requirement(Kind.SELF)
    if around.floor is not None:
        yield Requirement(Kind.FLOOR)
    yield from (Requirement(Kind.COUPLING, k) for k in range(len(cell.couplings)))
    if cell.max_joint_step < pi or cell.max_prismatic_step < inf:
        yield Requirement(Kind.STEP)


def selection_of(cell: Cell, arms: Sequence[int]) -> Selection:
    """All that is asked for of some arms."""
    whole = everything(cell)

    def concerns(one: Requirement) -> bool:
        if one.kind is Kind.COUPLING:
            return set(cell.couplings[one.index].arms) <= set(arms)
        return one.kind not in OF_ARMS or one.index in arms

    return replace(whole, requirements=frozenset(one for one in whole.requirements if concerns(one)))


def arms_of(cell: Cell, selection: Selection) -> list[int]:
    """Indices of the arms in a selection."""
    return [a for a in range(len(cell.arms)) if Requirement(Kind.ARM, a) in selection.requirements]


def restricted(cell: Cell, selection: Selection) -> Cell:
    """The cell with nothing but a selection of what it asks for; a single pose is held for two."""
    chosen, arms = selection.requirements, arms_of(cell, selection)
    part = cell.part(selection.first, selection.last)
    couplings = (c for k, c in enumerate(cell.couplings) if Requirement(Kind.COUPLING, k) in chosen)
    return replace(
        part,
        arms=tuple(_relaxed(part, a, chosen) for a in arms),
        max_joint_step=cell.max_joint_step if Requirement(Kind.STEP) in chosen else pi,
        max_prismatic_step=cell.max_prismatic_step if Requirement(Kind.STEP) in chosen else inf,
        surroundings=_surroundings(cell.surroundings, chosen),
        couplings=_among(couplings, arms),
    )


def _relaxed(cell: Cell, index: int, chosen: frozenset[Requirement]) -> Arm:
    """An arm without what is not chosen of it; the height of its base stays."""
    arm = cell.arms[index]
    if Requirement(Kind.REGION, index) not in chosen:
        windows = reach_windows(cell, arm)
        x, y = (Interval(float(np.min(windows[:, k, 0])), float(np.max(windows[:, k, 1]))) for k in range(2))
        arm = replace(arm, base=replace(arm.base, x=x, y=y, yaw=FREE_YAW))
    if Requirement(Kind.POSTURE, index) not in chosen:
        arm = replace(arm, posture=Posture())
    if Requirement(Kind.CONDITIONING, index) not in chosen:
        arm = replace(arm, min_conditioning=None)
    if Requirement(Kind.SINGULARITIES, index) not in chosen:
        arm = replace(arm, avoid_singularities=False)
    for k in reversed(range(len(arm.bounded_names) - arm.dof)):
        if arm.linear_limits is not None and Requirement(Kind.LINEAR, index, k) not in chosen:
            arm = replace(arm, linear_limits=arm.linear_limits.without(k))
    kept = np.array([Requirement(Kind.LIMITS, index, j) in chosen for j in range(arm.dof)])
    if np.all(kept | np.isinf(arm.upper - arm.lower)):
        return arm
    return replace(arm, lower=np.where(kept, arm.lower, -inf), upper=np.where(kept, arm.upper, inf))


def _surroundings(around: Surroundings, chosen: frozenset[Requirement]) -> Surroundings:
    asked = around.clearances
    return replace(
        around,
        obstacles=tuple(o for k, o in enumerate(around.obstacles) if Requirement(Kind.OBSTACLE, k) in chosen),
        part=around.part if Requirement(Kind.PART) in chosen else None,
        floor=around.floor if Requirement(Kind.FLOOR) in chosen else None,
        clearances=asked if Requirement(Kind.SELF) in chosen else replace(asked, self_collision=None),
    )


def _among(couplings: Iterable[Coupling], arms: list[int]) -> tuple[Coupling, ...]:
    """The couplings all of whose arms are there, with the arms' new numbers."""
    kept = (among(coupling, arms) for coupling in couplings)
    return tuple(coupling for coupling in kept if coupling is not None)
