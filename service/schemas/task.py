"""What the part does: poses one by one, a line, or an arc."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, Tag

from duocell.service.schemas.base import Label, Strict, Vector3, Weight, exactly_one_of
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
