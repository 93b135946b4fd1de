"""The request for a layout."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import ConfigDict, Discriminator, Field, Tag

from duocell.models.objective.joint_availability import JointAvailability
from duocell.models.objective.registry import MEASURES
from duocell.service.schemas.arm import Arm
from duocell.service.schemas.base import FIRST_WRONG, LEAST_WEIGHT, MOST_WEIGHT, TAG, Choice, Label, NotNegative, Strict
from duocell.service.schemas.coupling import Coupling
from duocell.service.schemas.shapes import BOX, Obstacle
from duocell.service.schemas.surroundings import Clearance, Floor, Part
from duocell.service.schemas.task import JOBS, LINE, FamilyJob, Task

PI_AS_PRINTED = 3.1416
"""Largest accepted max_joint_step: π, rounded up as people write it."""

Baseline = Literal["interior-penalty", "interior-penalty-log", "exterior-penalty"]

_REFERENCE = [0.1745, -0.3927, 2.7053, 0.5236, 0.1745, 0.1745]
EXAMPLE: dict[str, Any] = {
    "name": "two arms carry a part along a line",
    "task": {"line": LINE},
    "arms": [
        {
            "name": "main",
            "robot": "puma560",
            "grasp": {"position": [-0.06, -0.015, -0.02], "orientation": {"quaternion": [0.5, 0.5, 0.5, 0.5]}},
            "base": {"x": [-0.3, 2.1], "y": [-0.7, 1.7], "z": 0.0, "yaw": [-3.1416, 3.1416]},
            "reference": _REFERENCE,
        },
        {
            "name": "follower",
            "robot": "puma560",
            "grasp": {"position": [0.06, 0.015, 0.02], "orientation": {"quaternion": [0.5, 0.5, -0.5, -0.5]}},
            "base": {"x": [-0.3, 2.1], "y": [-0.7, 1.7], "z": 0.0, "yaw": [-3.1416, 3.1416]},
            "reference": _REFERENCE,
        },
    ],
    "max_joint_step": 1.5708,
    "certificate": {"gap": 0.01, "time_limit": 10.0},
}
"""A complete request; the tests send it."""


class Certificate(Strict):
    """How hard to prove that no base scores better."""

    gap: float = Field(
        default=0.01,
        gt=0.0,
        le=1.0,
        description="Stop once (objective - lower_bound) / objective is this small. One below 1e-5 may stay open "
        "where a limit is active, because limits may be missed by as much.",
        examples=[0.01],
    )
    time_limit: float = Field(default=10.0, gt=0.0, description="Stop after this many seconds.", examples=[10.0])


class JointSteps(Strict):
    """Largest changes of joints between consecutive poses, by kind of joint."""

    revolute: float = Field(
        default=pi / 2, gt=0.0, le=PI_AS_PRINTED, description="rad: of joints that turn, at most π.", examples=[1.5708]
    )
    prismatic: float | None = Field(
        default=None, gt=0.0, description="m: of the linear axis under an arm; null: as far as it goes.", examples=[0.3]
    )


def _number_or_steps(value: Any) -> str:
    return f"{TAG}steps" if isinstance(value, (dict, JointSteps)) else f"{TAG}number"


RevoluteStep = Annotated[float, Field(gt=0.0, le=PI_AS_PRINTED, json_schema_extra={"default": pi / 2})]
"""rad, the default told where it is read: by clients that know no other form."""
AnyJointStep = Annotated[
    Annotated[RevoluteStep, Tag("@number")] | Annotated[JointSteps, Tag("@steps")],
    Discriminator(_number_or_steps),
]
"""One number for the joints that turn, or one for each kind."""


def _word_or_settings(value: Any) -> str:
    return f"{TAG}settings" if isinstance(value, (dict, Certificate)) else f"{TAG}word"


AnyCertificate = Annotated[
    Annotated[Literal["auto"], Tag("@word")] | Annotated[Certificate, Tag("@settings")], Choice(_word_or_settings)
]
"""A word or how hard to prove."""


class Tolerance(Strict):
    """How far every base may be from where it should be."""

    position: NotNegative = Field(
        default=0.002, le=0.5, description="m, in every horizontal direction and in height.", examples=[0.002]
    )
    angle: NotNegative = Field(default=0.00175, le=0.5, description="rad, about the vertical.", examples=[0.00175])


if TYPE_CHECKING:
    MeasureName = str
else:
    MeasureName = Literal[tuple(MEASURES)]


class ObjectiveTerm(Strict):
    """A measure, and what its cost is multiplied by."""

    measure: MeasureName = Field(description="Its name.", examples=["manipulability"])
    weight: float = Field(
        default=1.0, ge=LEAST_WEIGHT, le=MOST_WEIGHT, description="What its cost is multiplied by.", examples=[1.0]
    )


class LayoutRequest(Strict):
    """Find the base placements that are best for the task: that keep all joints nearest to their references, if nothing
    else is asked for.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [EXAMPLE]})

    name: Label = Field(default="", description="Label of the layout.", examples=["line"])
    task: Task | None = Field(
        default=None,
        description="What the object does: exactly one of poses, line, arc. Either this or `tasks` is needed.",
        examples=[{"line": LINE}],
    )
    tasks: Annotated[list[FamilyJob], FIRST_WRONG] | None = Field(
        default=None,
        min_length=1,
        description="Several jobs for one layout, each arm in the same posture in all of them; in place of `task`.",
        examples=[JOBS],
    )
    arms: list[Arm] = Field(
        min_length=1, description="The arms that carry the object together.", examples=[EXAMPLE["arms"]]
    )
    obstacles: list[Obstacle] = Field(
        default=[],
        description="What stands in the cell and does not move.",
        examples=[[{"name": "table", "shape": BOX}]],
    )
    part: Part | None = Field(
        default=None,
        description="The body of the object; null: it has none.",
        examples=[{"shapes": [{"shape": BOX}], "grasp_zone": 0.15}],
    )
    floor: Floor | None = Field(
        default=None,
        description="Where bases may stand, besides the regions of the arms; null: everywhere.",
        examples=[{"forbidden": [[[0.5, -0.5], [1.5, -0.5], [1.5, 0.5]]], "margin": 0.05}],
    )
    coupling: list[Coupling] = Field(
        default=[],
        description="Ties between the bases.",
        examples=[[{"type": "same_z", "arms": ["main", "follower"]}]],
    )
    clearance: Clearance | None = Field(
        default=None,
        description="Distances to keep, per class of pairs; a class left out must not touch (0 m), one that is null is "
        "not looked at. null for the whole: contact is forbidden in every class if the request describes any body "
        "(obstacles, part, tool_shapes, pedestal), and nothing is looked at if it describes none.",
        examples=[{"arm_arm": 0.03, "arm_obstacle": 0.03, "self": None}],
    )
    objective: list[ObjectiveTerm] = Field(
        default=[ObjectiveTerm(measure=JointAvailability.name)],
        min_length=1,
        description="What the layout is to be best at: a weighted sum of measures, each at most once. Only for joint "
        "availability alone can it be proved how good the answer is, and can poses leave something open (`tolerance`).",
        examples=[[{"measure": "manipulability", "weight": 1.0}]],
    )
    max_joint_step: AnyJointStep = Field(
        default=pi / 2,
        description="rad: largest change of any joint that turns between consecutive poses, at most π. An object has "
        "one for each kind of joint, in m for a linear axis.",
        examples=[1.5708],
    )

    @property
    def joint_steps(self) -> JointSteps:
        """`max_joint_step` by kind of joint."""
        steps = self.max_joint_step
        return steps if isinstance(steps, JointSteps) else JointSteps(revolute=steps)

    time_limit: float | None = Field(
        default=None,
        gt=0.0,
        description="s for search, automatic proof and checks; what is usable then is the answer. The time of a "
        "`certificate` of its own and of `explain` comes on top. null: the default of the service, filled in when the "
        "request is accepted.",
        examples=[30.0],
    )
    certificate: AnyCertificate | None = Field(
        default="auto",
        description="How hard to prove that no layout scores better, or that there is none. auto: to 0.1 %, with about "
        "the effort that the search takes, counted in boxes, not in time; or a gap and a time limit; null: not at all.",
        examples=[EXAMPLE["certificate"]],
    )
    baselines: list[Baseline] = Field(
        default=[],
        max_length=3,
        description="Methods of the literature to run beside, for comparison.",
        examples=[["interior-penalty"]],
    )
    alternatives: int = Field(
        default=0, ge=0, le=10, description="How many other layouts to report at most.", examples=[3]
    )
    tolerance: Tolerance | None = Field(
        default=None,
        description="Ask what is left of margins and clearances if every base is off by so much; null: not asked.",
        examples=[{"position": 0.002, "angle": 0.00175}],
    )
    explain: bool = Field(
        default=False,
        description="Find out what blocks a cell without a layout, and what would help; takes up to the time limit "
        "again.",
        examples=[False],
    )
