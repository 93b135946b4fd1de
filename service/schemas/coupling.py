"""What ties the bases of arms together: everything the service knows of each kind of coupling.

A kind is a class here and its name in the union below: its fields, what they become (`made`), and which of them are
lengths or angles that no workcell exceeds.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from math import inf
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, get_args

from pydantic import Field

from duocell.models.cell import coupling as models
from duocell.models.robot.arm import Interval
from duocell.service.schemas.base import Label, NotNegative, NumberOrInterval, Strict, Vector2, one_of_types

_TWO = [["main", "follower"]]
_ANGLE = "rad from the world's x axis, counter-clockwise seen from above."

Pair = Annotated[list[Label], Field(min_length=2, max_length=2)]
Several = Annotated[list[Label], Field(min_length=2)]
OneOrMore = Annotated[list[Label], Field(min_length=1)]


class Tie(Strict):
    """What all kinds have."""

    LENGTHS: ClassVar[tuple[str, ...]] = ()
    """Fields in metres: a number, several, or null."""
    ANGLES: ClassVar[tuple[str, ...]] = ()
    """Fields in radians."""

    if TYPE_CHECKING:  # every kind has the field, after its type
        arms: list[str]

    @abstractmethod
    def made(self, arms: tuple[int, ...]) -> models.Coupling:
        """The coupling of arms with some numbers, or InvalidInput."""

    def lengths(self) -> Iterator[tuple[str, list[float]]]:
        """Every length [m] that is given, with its field."""
        return self._given(self.LENGTHS)

    def angles(self) -> Iterator[tuple[str, list[float]]]:
        """Every angle [rad] that is given, with its field."""
        return self._given(self.ANGLES)

    def _given(self, fields: tuple[str, ...]) -> Iterator[tuple[str, list[float]]]:
        for field in fields:
            value = getattr(self, field)
            if value is not None:
                yield field, value if isinstance(value, list) else [value]


class SameZ(Tie):
    """Base origins at one height."""

    type: Literal["same_z"] = Field(description="The same z.", examples=["same_z"])
    arms: Several = Field(description="Names of two or more arms.", examples=_TWO)

    def made(self, arms: tuple[int, ...]) -> models.Coupling:
        """See `Tie`."""
        return models.SameHeight(arms)


class Distance(Tie):
    """How near to each other and how far apart two bases may stand, seen from above."""

    LENGTHS: ClassVar = ("minimum", "maximum")

    type: Literal["distance"] = Field(description="Horizontal distance of two base origins.", examples=["distance"])
    arms: Pair = Field(description="Names of two arms.", examples=_TWO)
    minimum: NotNegative = Field(default=0.0, description="m.", examples=[1.0])
    maximum: NotNegative | None = Field(default=None, description="m; null: none.", examples=[2.5])

    def made(self, arms: tuple[int, ...]) -> models.Coupling:
        """See `Tie`."""
        return models.Distance(arms, self.minimum, inf if self.maximum is None else self.maximum)


class Direction(Tie):
    """In which direction the second base lies, seen from the first."""

    ANGLES: ClassVar = ("angle",)

    type: Literal["direction"] = Field(description="Direction from base to base.", examples=["direction"])
    arms: Pair = Field(description="Names of two arms: from the first to the second.", examples=_TWO)
    angle: float = Field(description=_ANGLE, examples=[1.5707963])

    def made(self, arms: tuple[int, ...]) -> models.Coupling:
        """See `Tie`."""
        return models.Direction(arms, self.angle)


class Mirror(Tie):
    """Two bases that are mirror images of each other: positions, heights, and the directions of their x axes."""

    LENGTHS: ClassVar = ("point",)
    ANGLES: ClassVar = ("angle",)

    type: Literal["mirror"] = Field(description="Mirrored about a vertical plane.", examples=["mirror"])
    arms: Pair = Field(description="Names of two arms.", examples=_TWO)
    point: Vector2 = Field(description="[x, y] in m of a point of the plane.", examples=[[0.9, 0.0]])
    angle: float = Field(description=f"Direction of the plane seen from above, {_ANGLE}", examples=[0.0])

    def made(self, arms: tuple[int, ...]) -> models.Coupling:
        """See `Tie`."""
        return models.Mirror(arms, (self.point[0], self.point[1]), self.angle)


class Rail(Tie):
    """Base origins on one straight horizontal rail, at one height."""

    LENGTHS: ClassVar = ("point",)
    ANGLES: ClassVar = ("angle",)

    type: Literal["rail"] = Field(description="On one straight line.", examples=["rail"])
    arms: OneOrMore = Field(description="Names of two or more arms, or of one where `point` is given.", examples=_TWO)
    angle: float = Field(description=f"Direction of the rail, {_ANGLE}", examples=[0.0])
    point: Vector2 | None = Field(
        default=None,
        description="[x, y] in m of a point the rail passes through; null: only its direction is given.",
        examples=[[0.0, -1.2]],
    )

    def made(self, arms: tuple[int, ...]) -> models.Coupling:
        """See `Tie`."""
        point = None if self.point is None else (self.point[0], self.point[1])
        return models.Rail(arms, self.angle, point)


class Rigid(Tie):
    """Two arms on one stand: the second base as seen from the first, in the frame of the first base."""

    LENGTHS: ClassVar = ("x", "y", "z")
    ANGLES: ClassVar = ("yaw",)

    type: Literal["rigid"] = Field(description="On one stand.", examples=["rigid"])
    arms: Pair = Field(description="Names of two arms; both stand upright.", examples=_TWO)
    x: NumberOrInterval = Field(description="m, along the x axis of the first base.", examples=[0.8])
    y: NumberOrInterval = Field(description="m, along the y axis of the first base.", examples=[[-0.1, 0.1]])
    z: NumberOrInterval = Field(default=0.0, description="m, by how much the second base is higher.", examples=[0.0])
    yaw: NumberOrInterval = Field(
        default=0.0,
        description="rad, by how much the second base is turned against the first, counter-clockwise seen from above. "
        "Counts modulo 2π: an interval 2π wide or wider is free.",
        examples=[3.1415926],
    )

    def made(self, arms: tuple[int, ...]) -> models.Coupling:
        """See `Tie`."""
        x, y, z, yaw = (
            Interval(*value) if isinstance(value, list) else Interval(value, value)
            for value in (self.x, self.y, self.z, self.yaw)
        )
        return models.Rigid(arms, x, y, z, yaw)


Kind = SameZ | Distance | Direction | Mirror | Rail | Rigid

if TYPE_CHECKING:
    Coupling = Kind
else:
    Coupling = one_of_types(*get_args(Kind))
