"""What stands in a cell besides its arms: obstacles, the part, pedestals, tools, the floor, distances to keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import transform
from duocell.models.base.ranges import check_between
from duocell.models.catalogue.links import LinkBody, link_bodies
from duocell.models.cell.floor import POINT, Floor, Footprint
from duocell.models.geometry.floor_level import bulges_below
from duocell.models.geometry.shapes import LARGEST, SMALLEST, Body, Box, ConvexHull, Cylinder, HalfSpace, Shape
from duocell.models.robot.arm import Arm

Obstacle = Body
"""A body in the world."""


class PairClass(StrEnum):
    """Kinds of pairs that must keep apart; the values are the contract's words."""

    ARM_ARM = "arm_arm"
    ARM_PART = "arm_part"
    ARM_OBSTACLE = "arm_obstacle"
    PART_OBSTACLE = "part_obstacle"
    SELF = "self"


@dataclass(frozen=True, eq=False)
class Part:
    """What the arms carry.

    Attributes:
        bodies: in the object frame.
        grasp_zone: m; an arm may touch what lies nearer than this to a grasp (along each axis of the body it lies in).
    """

    bodies: tuple[Body, ...]
    grasp_zone: float = 0.0

    def __post_init__(self) -> None:
        check_between("grasp_zone", self.grasp_zone, (0.0, LARGEST), "/grasp_zone")
        for index, body in enumerate(self.bodies):
            if isinstance(body.shape, HalfSpace):
                raise InvalidInput("a half-space cannot be carried; use a box.", f"/bodies/{index}/shape")


PLATE = 0.01
"""m, thickness of the top of a pedestal, by which is told which links have to keep off it."""
LOWER = 1e-5
"""m by which a base may stand lower than its region allows, and more."""


@dataclass(frozen=True, eq=False)
class Pedestal:
    """What an arm is bolted onto; it moves with the base and is solid from the base origin downwards.

    One that reaches to the floor is as high as its base stands: what of it is below the floor where a base is lower
    than the highest is thought of as solid too, and nothing that ends at the floor counts against it or its base link.

    Attributes:
        height: m, along the base's z axis; of one that reaches to the floor the largest.
        footprint: of the pedestal, the same at every height.
        foot: z [m] of the floor that it reaches to, wherever the base stands; None where its height is what it is.
    """

    height: float
    footprint: Footprint
    foot: float | None = None

    def __post_init__(self) -> None:
        check_between("the height of a pedestal", self.height, (SMALLEST, LARGEST), "/height")
        if len(self.footprint.corners) == 1 and self.footprint.radius <= 0.0:
            raise InvalidInput("the footprint of a pedestal needs an area.", "/footprint")
        try:
            _ = self.body  # whether it can be built is seen here and not in the middle of a search
        except InvalidInput as error:
            raise InvalidInput(f"the footprint of a pedestal cannot be used: {error.detail}", "/footprint") from error

    def under(self, z: float) -> Pedestal:
        """The pedestal as it is under a base at z [m]."""
        return self if self.foot is None else replace(self, height=z - self.foot)

    def surely_under(self, z: float) -> Pedestal:
        """What there is of it wherever the base stands at z [m] or higher: all that a proof may rest on."""
        return self if self.foot is None else replace(self, height=max(z - self.foot - LOWER, SMALLEST))

    @property
    def plate(self) -> Pedestal:
        """The top of it, which is the same under every base."""
        return replace(self, height=min(self.height, PLATE))

    @property
    def body(self) -> Body:
        """The solid in the base frame, its top at the base origin."""
        corners, radius = self.footprint.corners, self.footprint.radius
        middle = transform(np.eye(3), [0.0, 0.0, -0.5 * self.height])
        shape: Shape
        if len(corners) == 1:
            middle[:2, 3] = corners[0]
            shape = Cylinder(radius, self.height)
        else:
            size = corners.max(axis=0) - corners.min(axis=0)
            square = len(corners) == 4 and np.allclose(np.abs(corners), 0.5 * size, rtol=0.0, atol=1e-12)
            if square and radius == 0.0:
                shape = Box(np.array([*size, self.height]))
            else:
                shape = _prism(_swollen(corners, radius), self.height)
        return Body("pedestal", middle, shape)


@dataclass(frozen=True, slots=True)
class Clearances:
    """Distances [m] that pairs of a class must keep; None = not asked for, and not looked at."""

    arm_arm: float | None = None
    arm_part: float | None = None
    arm_obstacle: float | None = None
    part_obstacle: float | None = None
    self_collision: float | None = None

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if value is not None:
                name = "self" if one.name == "self_collision" else one.name
                check_between(f"the clearance {name}", value, (0.0, LARGEST), f"/{name}")

    @property
    def any(self) -> bool:
        """True if any class is asked for."""
        return any(getattr(self, one.name) is not None for one in fields(self))

    def required(self, kind: PairClass) -> float | None:
        """The distance of a class [m], or None."""
        value: float | None = getattr(self, "self_collision" if kind is PairClass.SELF else str(kind))
        return value


@dataclass(frozen=True, eq=False)
class Equipment:
    """What one arm brings along.

    Attributes:
        tool: bodies in the flange frame.
        pedestal: under the base, or None.
        links: bodies of the links, or None for those the catalogue knows or estimates
        (`duocell.models.catalogue.links`).
        footprint: what the base covers of the floor, or None for that of the pedestal.
    """

    tool: tuple[Body, ...] = ()
    pedestal: Pedestal | None = None
    links: tuple[LinkBody, ...] | None = None
    footprint: Footprint | None = None

    def __post_init__(self) -> None:
        for index, body in enumerate(self.tool):
            if isinstance(body.shape, HalfSpace):
                raise InvalidInput("a half-space is no tool; use a box.", f"/tool/{index}/shape")


NOTHING = Equipment()


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What a cell holds besides its arms and its task.

    Attributes:
        obstacles: in the world, names unique.
        part: None if the object has no body.
        floor: None if bases may stand anywhere.
        clearances: distances to keep.
        equipment: name of an arm -> what it brings along; arms without an entry bring nothing.
    """

    obstacles: tuple[Obstacle, ...] = ()
    part: Part | None = None
    floor: Floor | None = None
    clearances: Clearances = Clearances()
    equipment: Mapping[str, Equipment] = field(default_factory=dict)

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for index, obstacle in enumerate(self.obstacles):
            if obstacle.name in seen:
                raise InvalidInput(f"two obstacles are called {obstacle.name!r}.", f"/obstacles/{index}/name")
            seen.add(obstacle.name)
        object.__setattr__(self, "equipment", dict(self.equipment))
        for pedestal in (brings.pedestal for brings in self.equipment.values()):
            if pedestal is not None and pedestal.foot is not None:
                self._check_floor(pedestal.foot)

    def _check_floor(self, level: float) -> None:
        """Refuse obstacles that would be hit below a floor but not above it, for a pedestal that reaches to it.

        Raises:
            InvalidInput: pointer ``/obstacles``.
        """
        for obstacle in self.obstacles:
            if bulges_below(obstacle, level):
                raise InvalidInput(
                    f"{obstacle.name!r} goes through z = {level:g} m, where a pedestal stands, and is wider below: "
                    "cut it there, or describe it by a box that stands upright.",
                    "/obstacles",
                )

    def of(self, arm: str) -> Equipment:
        """What an arm brings along."""
        return self.equipment.get(arm, NOTHING)

    def links(self, arm: Arm) -> tuple[LinkBody, ...]:
        """Bodies of an arm's links."""
        own = self.of(arm.name).links
        return own if own is not None else link_bodies(arm.robot)

    def footprint(self, arm: str) -> Footprint:
        """What an arm covers of the floor: its footprint, its pedestal's, or its origin alone."""
        equipment = self.of(arm)
        if equipment.footprint is not None:
            return equipment.footprint
        return POINT if equipment.pedestal is None else equipment.pedestal.footprint


def _swollen(corners: Floats, radius: float) -> Floats:
    """Corners of a polygon that contains a polygon swollen by a radius: every corner becomes an octagon around it."""
    if radius == 0.0:
        return corners
    angles = np.arange(8) * (np.pi / 4.0)
    around = radius / np.cos(np.pi / 8.0) * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    swollen: Floats = (corners[:, None, :] + around).reshape(-1, 2)
    return swollen


def _prism(corners: Floats, height: float) -> ConvexHull:
    """A polygon's prism, centred on z = 0."""
    ring = np.repeat(corners, 2, axis=0)
    levels = np.tile([-0.5 * height, 0.5 * height], len(corners))
    return ConvexHull(np.column_stack([ring, levels]))
