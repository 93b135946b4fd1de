"""What a cell holds besides task and arms: the part's body, the floor, pedestals, and distances to keep."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, Tag

from duocell.service.schemas.base import NotNegative, Polygon, Positive, PositiveVector2, Strict, exactly_one_of
from duocell.service.schemas.shapes import BOX, Solid

_SOLIDS = [{"shape": BOX}]
_ROOM = [[-2.0, -2.0], [3.0, -2.0], [3.0, 2.0], [-2.0, 2.0]]
_PIT = [[0.5, -0.5], [1.5, -0.5], [1.5, 0.5], [0.5, 0.5]]


class Part(Strict):
    """The body of what the arms carry."""

    shapes: list[Solid] = Field(
        min_length=1,
        description="Solids in the object frame, carried along the task. Half-spaces are refused.",
        examples=[_SOLIDS],
    )
    grasp_zone: NotNegative = Field(
        default=0.0,
        description="m. A cube of this half size around every grasp (along the axes of the shape it lies in) is left "
        "out of the part where arms are concerned. The last link of an arm and its tool hold the part and may always "
        "touch it.",
        examples=[0.15],
    )


class Floor(Strict):
    """Where bases may be, seen from above; it binds arms on walls and ceilings too."""

    allowed: Polygon | None = Field(
        default=None,
        description="Corners [x, y] in m of the polygon that every footprint must lie in; null: everywhere.",
        examples=[_ROOM],
    )
    forbidden: list[Polygon] = Field(default=[], description="Polygons that no footprint may touch.", examples=[[_PIT]])
    margin: NotNegative = Field(
        default=0.0, description="m, distance that footprints keep to all of these.", examples=[0.05]
    )


class RectangularFootprint(Strict):
    """A rectangular plate."""

    size: PositiveVector2 = Field(
        description="[x, y] in m, full lengths along the axes of the base frame, centred on its origin.",
        examples=[[0.4, 0.4]],
    )


class RoundFootprint(Strict):
    """A round plate."""

    radius: Positive = Field(description="m, about the origin of the base frame.", examples=[0.2])


class PolygonalFootprint(Strict):
    """A convex plate."""

    polygon: Polygon = Field(
        description="Corners [x, y] in m in the base frame; convex.", examples=[[[-0.2, -0.2], [0.3, 0.0], [-0.2, 0.2]]]
    )


Footprint = Annotated[
    Annotated[RectangularFootprint, Tag("@size")]
    | Annotated[RoundFootprint, Tag("@radius")]
    | Annotated[PolygonalFootprint, Tag("@polygon")],
    exactly_one_of("size", "radius", "polygon"),
]


class Pedestal(Strict):
    """What an arm is bolted onto: a solid from the origin of the base frame down along its z axis."""

    height: Positive | None = Field(
        default=None,
        description="m; null: from `foot` up to the base, as high as that stands. A height that does not fit a fixed "
        "z, or that is given where z is free, is refused. Bases that hang or lean need one.",
        examples=[0.6],
    )
    foot: float | None = Field(
        default=None,
        description="m, z of what it stands on; null: 0. Without a height what ends there does not count against the "
        "pedestal and the base link, and nothing may pass below it.",
        examples=[0.0],
    )
    footprint: Footprint = Field(
        description="The same at every height: exactly one of size, radius, polygon.", examples=[{"size": [0.4, 0.4]}]
    )


class Clearance(Strict):
    """Distances to keep along the whole path, between the poses too; null: pairs of this class are not looked at."""

    arm_arm: NotNegative | None = Field(
        default=0.0, description="m, between two arms with their tools and pedestals.", examples=[0.03]
    )
    arm_part: NotNegative | None = Field(
        default=0.0,
        description="m, between the part and the arms, but for last links, tools and the grasp zones.",
        examples=[0.03],
    )
    arm_obstacle: NotNegative | None = Field(
        default=0.0,
        description="m, between arms and obstacles. What a base is mounted on does not count for the base link: the "
        "one surface that is met from its mounting face (its origin where the face is not known) along its own -z "
        "within 20 mm.",
        examples=[0.03],
    )
    part_obstacle: NotNegative | None = Field(
        default=0.0, description="m, between the part and obstacles.", examples=[0.03]
    )
    self: NotNegative | None = Field(
        default=0.0, description="m, between the links of an arm, its tool and its pedestal.", examples=[0.0]
    )
