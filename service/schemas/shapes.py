"""Solid shapes, and bodies: a shape with its place in the frame it belongs to."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Tag

from duocell.service.schemas.base import Label, Positive, PositiveVector3, Strict, tagged_by_type
from duocell.service.schemas.pose import IDENTITY, Pose

_POSE = {"position": [0.9, 0.5, 0.35], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}
BOX = {"type": "box", "size": [1.2, 0.08, 0.08]}
CAPSULE = {"type": "capsule", "radius": 0.05, "length": 0.1}


class Box(Strict):
    """A cuboid centred on its frame."""

    type: Literal["box"] = Field(description="A cuboid.", examples=["box"])
    size: PositiveVector3 = Field(description="[x, y, z] in m, full lengths.", examples=[[1.2, 0.08, 0.08]])


class Sphere(Strict):
    """A ball centred on its frame."""

    type: Literal["sphere"] = Field(description="A ball.", examples=["sphere"])
    radius: Positive = Field(description="m.", examples=[0.1])


class Cylinder(Strict):
    """A round cylinder about z, centred on its frame."""

    type: Literal["cylinder"] = Field(description="A round cylinder about z.", examples=["cylinder"])
    radius: Positive = Field(description="m.", examples=[0.1])
    length: Positive = Field(description="m, along z.", examples=[0.5])


class Capsule(Strict):
    """All that is within a radius of a segment along z, centred on its frame."""

    type: Literal["capsule"] = Field(description="A segment along z with a radius.", examples=["capsule"])
    radius: Positive = Field(description="m.", examples=[0.05])
    length: Positive = Field(description="m, of the segment: the round caps are extra.", examples=[0.1])


class HalfSpace(Strict):
    """Everything with z <= 0 in its frame: a floor; turned, a wall or a ceiling."""

    type: Literal["half_space"] = Field(description="All with z <= 0.", examples=["half_space"])


class Mesh(Strict):
    """An uploaded mesh; what is not convex stands as the convex pieces it was taken apart into."""

    type: Literal["mesh"] = Field(description="An uploaded mesh.", examples=["mesh"])
    id: Label = Field(min_length=1, description="Identifier of the mesh.", examples=["fixture"])
    scale: Positive = Field(
        default=1.0, description="Factor from the units of the file to m; 0.001 for millimetres.", examples=[0.001]
    )


Shape = Annotated[
    Annotated[Box, Tag("@box")]
    | Annotated[Sphere, Tag("@sphere")]
    | Annotated[Cylinder, Tag("@cylinder")]
    | Annotated[Capsule, Tag("@capsule")]
    | Annotated[HalfSpace, Tag("@half_space")]
    | Annotated[Mesh, Tag("@mesh")],
    tagged_by_type("box", "sphere", "cylinder", "capsule", "half_space", "mesh"),
]


class Solid(Strict):
    """A shape somewhere."""

    pose: Pose = Field(
        default=IDENTITY, description="Frame of the shape in the frame that the solid belongs to.", examples=[_POSE]
    )
    shape: Shape = Field(description="The shape; its `type` says which.", examples=[BOX])


class Obstacle(Strict):
    """Something that stands in the cell and does not move."""

    name: Label = Field(min_length=1, description="Label, unique in the request; reports use it.", examples=["table"])
    pose: Pose = Field(default=IDENTITY, description="Frame of the shape in the world.", examples=[_POSE])
    shape: Shape = Field(description="The shape; its `type` says which.", examples=[BOX])
