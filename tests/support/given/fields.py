"""Fields that helpers hand on to what they make."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypedDict

from duocell.models.base.arrays import Floats
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.floor import Floor
from duocell.models.cell.surroundings import Clearances, Equipment, Obstacle, Part, Surroundings
from duocell.models.robot.arm import BaseRegion, Interval
from duocell.models.robot.linear_limits import LinearLimits
from duocell.models.robot.posture import Posture
from duocell.models.robot.robot import Robot


class ArmFields(TypedDict, total=False):
    """Of `Arm`, without the robot, the name and the base."""

    tool: Floats
    grasp: Floats
    lower: Floats
    upper: Floats
    reference: Floats
    weights: Floats
    posture: Posture
    min_conditioning: float | None
    mount: Floats
    grasps: Floats | None
    avoid_singularities: bool
    linear_limits: LinearLimits | None


class ArmChanges(ArmFields, total=False):
    """Of `Arm`, all of them."""

    name: str
    robot: Robot
    base: BaseRegion


class BaseSides(TypedDict, total=False):
    """Of `BaseRegion`."""

    x: Interval
    y: Interval
    z: Interval
    yaw: Interval


class WitnessFields(ArmFields, total=False):
    """Of a task that is possible by construction (`tests.support.given.tasks.possible`), and of its arm."""

    half: tuple[float, float, float, float]
    max_joint_step: float
    tight: float | None


class PossibleFields(WitnessFields, total=False):
    """The same with the length of the task."""

    poses: int
    step: float


class CellFields(TypedDict, total=False):
    """Of `Cell`, without task and arms."""

    max_joint_step: float
    name: str
    surroundings: Surroundings
    couplings: tuple[Coupling, ...]


class SurroundingsFields(TypedDict, total=False):
    """Of `Surroundings`."""

    obstacles: tuple[Obstacle, ...]
    part: Part | None
    floor: Floor | None
    clearances: Clearances
    equipment: Mapping[str, Equipment]
