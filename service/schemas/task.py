"""What the part does: poses one by one, a line, or an arc; and what its poses leave open for the tool of an arm."""

from __future__ import annotations

from math import pi
from typing import Annotated, Any, Literal

from pydantic import Field, Tag

from duocell.service.schemas.base import (
    TAG,
    Choice,
    Interval,
    Label,
    NotNegative,
    Positive,
    Strict,
    Vector3,
    Weight,
    exactly_one_of,
)
from duocell.service.schemas.pose import Pose, PoseList

LINE_START = {"position": [0.73, 0.35, 0.1], "orientation": {"rpy": [0.0, 0.0, -0.785398]}}
LINE_END = {"position": [1.09, 0.7, 0.1], "orientation": {"rpy": [0.0, 0.0, -0.785398]}}
LINE = {"start": LINE_START, "end": LINE_END, "count": 10}
ARC_START = {"position": [0.9, 0.0, 0.1], "orientation": {"rpy": [0.0, 0.0, 0.0]}}
ARC_END = {"position": [0.0, 0.9, 0.1], "orientation": {"rpy": [0.0, 0.0, 1.570796]}}
ARC = {"start": ARC_START, "end": ARC_END, "center": [0.0, 0.0, 0.1], "count": 10}

_COUNT = "Number of poses, both ends included."


class Line(Strict):
    """Equally spaced poses on a straight line; the orientation turns the shortest way."""

    start: Pose = Field(description="First pose of the object in the world.", examples=[LINE_START])
    end: Pose = Field(
        description="Last pose of the object in the world; orientations 180° apart are refused.", examples=[LINE_END]
    )
    count: int = Field(ge=2, description=_COUNT, examples=[10])


class ArcByCenter(Strict):
    """Equally spaced poses on the minor arc about a centre."""

    start: Pose = Field(description="First pose of the object in the world.", examples=[ARC_START])
    end: Pose = Field(description="Last pose of the object in the world.", examples=[ARC_END])
    center: Vector3 = Field(
        description="[x, y, z] in m, equally far from both ends to 1e-6 m. The minor arc is taken; ends opposite to "
        "each other (180°) are refused.",
        examples=[[0.0, 0.0, 0.1]],
    )
    count: int = Field(ge=2, description=_COUNT, examples=[10])


class ArcByRadius(Strict):
    """Equally spaced poses on an arc of given radius, counter-clockwise about a normal."""

    start: Pose = Field(description="First pose of the object in the world.", examples=[ARC_START])
    end: Pose = Field(description="Last pose of the object in the world.", examples=[ARC_END])
    radius: float = Field(gt=0.0, description="m. The arc is at most 180°.", examples=[0.9])
    normal: Vector3 = Field(
        description="Direction of the axis of the arc, any length but zero; the arc runs counter-clockwise about it.",
        examples=[[0.0, 0.0, 1.0]],
    )
    count: int = Field(ge=2, description=_COUNT, examples=[10])


Arc = Annotated[
    Annotated[ArcByCenter, Tag("@center")] | Annotated[ArcByRadius, Tag("@radius")],
    exactly_one_of("center", "radius"),
]


class PosesTask(Strict):
    """Every pose given."""

    poses: PoseList = Field(
        description="Poses of the object in the world, in the order in which they are passed.",
        examples=[[LINE_START, LINE_END]],
    )


class LineTask(Strict):
    """A straight line."""

    line: Line = Field(description="A straight line.", examples=[LINE])


class ArcTask(Strict):
    """A circular arc."""

    arc: Arc = Field(description="A circular arc, by its centre or by radius and normal.", examples=[ARC])


Task = Annotated[
    Annotated[PosesTask, Tag("@poses")] | Annotated[LineTask, Tag("@line")] | Annotated[ArcTask, Tag("@arc")],
    exactly_one_of("poses", "line", "arc"),
]

JOBS: list[dict[str, Any]] = [
    {"name": "carry", "task": {"line": LINE}},
    {"name": "turn", "task": {"arc": ARC}, "weight": 0.5},
]


class FamilyJob(Strict):
    """One of several jobs that the same layout has to serve."""

    name: Label = Field(min_length=1, description="Label, unique in the request.", examples=["carry"])
    task: Task = Field(
        description="What the object does in this job: exactly one of poses, line, arc. Nothing is planned from the "
        "end of one job to the start of the next.",
        examples=[{"line": LINE}],
    )
    weight: Weight = Field(
        default=1.0,
        description="What each pose of this job counts for in the objective, 1e-6 to 1e6; 0: the job only has to be "
        "possible.",
        examples=[1.0],
    )
    grasps: dict[str, Pose] = Field(
        default={},
        description="Name of an arm -> its TCP in the object frame in this job; the other arms keep their `grasp`.",
        examples=[{"main": {"position": [0.0, 0.1, 0.0], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}}],
    )


# --- what poses leave open --------------------------------------------------------------------------------------------

FREE_ROLL: dict[str, Any] = {"roll": {"range": "free"}}
"""A tool that is symmetric, or whose roll nobody minds."""


def _word_or_interval(value: Any) -> str:
    return f"{TAG}interval" if isinstance(value, list) else f"{TAG}word"


FreeOrInterval = Annotated[
    Annotated[Literal["free"], Tag("@word")] | Annotated[Interval, Tag("@interval")], Choice(_word_or_interval)
]
"""Anything, or an interval."""
MOST_TOLERANCES = 64
"""Tolerances of one arm."""


class PositionRange(Strict):
    """A box that the tool centre point may be in, about where the task wants it; an axis left out is not open."""

    x: Interval | None = Field(default=None, description="[low, high] in m along x.", examples=[[-0.005, 0.005]])
    y: Interval | None = Field(default=None, description="[low, high] in m along y.", examples=[[-0.005, 0.005]])
    z: Interval | None = Field(default=None, description="[low, high] in m along z.", examples=[[0.0, 0.02]])


class RotationRange(Strict):
    """Turns Rx(x) Ry(y) Rz(z) that the tool may be off by; an axis left out is not open."""

    x: FreeOrInterval | None = Field(
        default=None, description="[low, high] in rad about x, or 'free'.", examples=[[-0.1, 0.1]]
    )
    y: Interval | None = Field(
        default=None, description="[low, high] in rad about y, within ±π/2.", examples=[[-0.1, 0.1]]
    )
    z: FreeOrInterval | None = Field(
        default=None, description="[low, high] in rad about z, or 'free'.", examples=["free"]
    )


class Cone(Strict):
    """An axis of the tool may point anywhere within a cone; the tool is tilted there the shortest way."""

    axis: Vector3 = Field(
        default=[0.0, 0.0, 1.0], description="Direction of the axis, in the frame.", examples=[[0.0, 0.0, 1.0]]
    )
    angle: Positive = Field(
        le=pi, description="rad between the axis and the edge of the cone, half its opening.", examples=[0.26]
    )


class Roll(Strict):
    """A turn about one axis: free for a symmetric tool, for welding, spraying, drilling."""

    axis: Vector3 = Field(
        default=[0.0, 0.0, 1.0], description="Direction of the axis, in the frame.", examples=[[0.0, 0.0, 1.0]]
    )
    range: FreeOrInterval = Field(
        default="free", description="'free' (default), or [low, high] in rad.", examples=["free"]
    )


class LargestStep(Strict):
    """By how much what is open may change from pose to pose."""

    position: NotNegative | None = Field(
        default=None, description="m along each axis; null: by anything.", examples=[0.005]
    )
    rotation: NotNegative | None = Field(
        default=None, description="rad about each axis; null: by anything.", examples=[0.3]
    )


class PoseTolerance(Strict):
    """What a pose leaves open: the tool may be displaced from it, by anything within these ranges."""

    frame: Literal["tool", "part", "world"] = Field(
        default="tool",
        description="Axes of the ranges, and what is turned about. tool: the tool centre point and its axes; part: the "
        "origin and axes of the part; world: the tool centre point, and the world's axes.",
        examples=["tool"],
    )
    position: PositionRange | None = Field(
        default=None, description="A box for the position; null: it is given.", examples=[{"z": [0.0, 0.02]}]
    )
    rotation: RotationRange | None = Field(
        default=None,
        description="Ranges for the orientation, in place of cone and roll; null: none.",
        examples=[{"x": [-0.1, 0.1], "y": [-0.1, 0.1]}],
    )
    cone: Cone | None = Field(
        default=None, description="An axis within a cone; null: none.", examples=[{"angle": 0.26}]
    )
    roll: Roll | None = Field(
        default=None,
        description="A turn about an axis; null: none. With a cone about the same axis: after the tilt.",
        examples=[{"range": "free"}],
    )
    max_step: LargestStep | None = Field(
        default=None,
        description="A limit on the change from pose to pose, so that the tool does not spin to and fro; null: none.",
        examples=[{"rotation": 0.3}],
    )
    same_for_all: bool = Field(
        default=False, description="true: one displacement for all poses of a segment, to be chosen.", examples=[False]
    )
    poses: Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=2, max_length=2)] | None = Field(
        default=None,
        description="[first, last] pose that it holds for, counted from 0 segment after segment; null: all.",
        examples=[[0, 9]],
    )


def _one_or_several(value: Any) -> str:
    return f"{TAG}several" if isinstance(value, list) else f"{TAG}one"


PoseTolerances = Annotated[
    Annotated[PoseTolerance, Tag("@one")]
    | Annotated[list[PoseTolerance], Field(min_length=1, max_length=MOST_TOLERANCES), Tag("@several")],
    Choice(_one_or_several),
]
"""One tolerance, or several for ranges of poses."""
