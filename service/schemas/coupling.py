"""What ties the bases of arms together."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Tag

from duocell.service.schemas.base import Label, NotNegative, Strict, Vector2, tagged_by_type

_TWO = [["main", "follower"]]
_ANGLE = "rad from the world's x axis, counter-clockwise seen from above."

Pair = Annotated[list[Label], Field(min_length=2, max_length=2)]
Several = Annotated[list[Label], Field(min_length=2)]
OneOrMore = Annotated[list[Label], Field(min_length=1)]


class SameZ(Strict):
    """Base origins at one height."""

    type: Literal["same_z"] = Field(description="The same z.", examples=["same_z"])
    arms: Several = Field(description="Names of two or more arms.", examples=_TWO)


class Distance(Strict):
    """How near to each other and how far apart two bases may stand, seen from above."""

    type: Literal["distance"] = Field(description="Horizontal distance of two base origins.", examples=["distance"])
    arms: Pair = Field(description="Names of two arms.", examples=_TWO)
    minimum: NotNegative = Field(default=0.0, description="m.", examples=[1.0])
    maximum: NotNegative | None = Field(default=None, description="m; null: none.", examples=[2.5])


class Direction(Strict):
    """In which direction the second base lies, seen from the first."""

    type: Literal["direction"] = Field(description="Direction from base to base.", examples=["direction"])
    arms: Pair = Field(description="Names of two arms: from the first to the second.", examples=_TWO)
    angle: float = Field(description=_ANGLE, examples=[1.5707963])


class Mirror(Strict):
    """Two bases that are mirror images of each other: positions, heights, and the directions of their x axes."""

    type: Literal["mirror"] = Field(description="Mirrored about a vertical plane.", examples=["mirror"])
    arms: Pair = Field(description="Names of two arms.", examples=_TWO)
    point: Vector2 = Field(description="[x, y] in m of a point of the plane.", examples=[[0.9, 0.0]])
    angle: float = Field(description=f"Direction of the plane seen from above, {_ANGLE}", examples=[0.0])


class Rail(Strict):
    """Base origins on one straight horizontal rail, at one height."""

    type: Literal["rail"] = Field(description="On one straight line.", examples=["rail"])
    arms: OneOrMore = Field(description="Names of two or more arms, or of one where `point` is given.", examples=_TWO)
    angle: float = Field(description=f"Direction of the rail, {_ANGLE}", examples=[0.0])
    point: Vector2 | None = Field(
        default=None,
        description="[x, y] in m of a point the rail passes through; null: only its direction is given.",
        examples=[[0.0, -1.2]],
    )


Coupling = Annotated[
    Annotated[SameZ, Tag("@same_z")]
    | Annotated[Distance, Tag("@distance")]
    | Annotated[Direction, Tag("@direction")]
    | Annotated[Mirror, Tag("@mirror")]
    | Annotated[Rail, Tag("@rail")],
    tagged_by_type("same_z", "distance", "direction", "mirror", "rail"),
]
