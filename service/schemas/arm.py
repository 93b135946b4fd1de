"""An arm of a request: robot, tool, grasp, where its base may stand and what it should prefer."""

from __future__ import annotations

from math import pi
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from duocell.service.schemas.base import MOST_JOINTS, TAG, Interval, Label, NumberOrInterval, PerJoint, Strict, Weight
from duocell.service.schemas.pose import IDENTITY, Pose
from duocell.service.schemas.shapes import CAPSULE, Solid
from duocell.service.schemas.surroundings import Footprint, Pedestal
from duocell.service.schemas.task import FREE_ROLL, PoseTolerances


def _word_or_list(value: Any) -> str:
    return f"{TAG}list" if isinstance(value, list) else f"{TAG}word"


def _name_or_table(value: Any) -> str:
    return f"{TAG}table" if isinstance(value, (dict, DhTable)) else f"{TAG}name"


Weights = Annotated[
    Annotated[Literal["range", "equal"], Tag("@word")] | Annotated[list[Weight], PerJoint, Tag("@list")],
    Discriminator(_word_or_list),
]


class Base(Strict):
    """Where the base may stand in the world; each value a number (fixed) or [low, high]."""

    x: NumberOrInterval = Field(description="m, of the origin of the base frame.", examples=[[-1.0, 1.0]])
    y: NumberOrInterval = Field(description="m.", examples=[[0.0, 2.0]])
    z: NumberOrInterval = Field(description="m.", examples=[0.0])
    yaw: NumberOrInterval = Field(
        description="rad about the vertical (with a `mount`: about z of the base). Counts modulo 2π: an interval 2π "
        "wide or wider is free, the reported yaw lies in the given interval.",
        examples=[[-pi, pi]],
    )


class Mount(Strict):
    """How the base is turned before its yaw: its orientation in the world is Ry(pitch) Rx(roll) Rz(yaw)."""

    roll: float = Field(
        default=0.0, description="rad about the world's x axis. π: hanging from the ceiling.", examples=[pi]
    )
    pitch: float = Field(
        default=0.0,
        description="rad about the world's y axis, after the roll. π/2: on a wall, z of the base along the world's x.",
        examples=[0.0],
    )


FLOOR_MOUNT = Mount()


class DhRow(Strict):
    """One joint in standard Denavit-Hartenberg terms: Rot(z, θ) Trans(z, d) Trans(x, a) Rot(x, α).

    The value of a revolute joint is added to θ, that of a prismatic one to d.
    """

    type: Literal["revolute", "prismatic"] = Field(
        default="revolute",
        description="How the joint moves. Only the first may be prismatic: a linear axis that carries the arm.",
        examples=["revolute"],
    )

    alpha: float = Field(description="Twist α in rad.", examples=[-pi / 2])
    a: float = Field(description="Length a in m.", examples=[0.4318])
    d: float = Field(description="Offset d in m.", examples=[0.1491])
    theta_offset: float = Field(
        default=0.0,
        description="rad, added to the joint value to give θ; θ itself if the joint is prismatic.",
        examples=[pi / 2],
    )
    lower: float = Field(
        description="Lower limit of the joint value in rad, or m if it is prismatic.", examples=[-2.79]
    )
    upper: float = Field(description="Upper limit of the joint value in rad, or m if it is prismatic.", examples=[2.79])


class DhTable(Strict):
    """A robot by its table."""

    dh: list[DhRow] = Field(
        min_length=1,
        max_length=MOST_JOINTS,
        description="One row per joint, from the base to the flange; six or seven joints.",
        examples=[[{"alpha": -pi / 2, "a": 0.0, "d": 0.4, "lower": -2.9, "upper": 2.9}]],
    )
    first_frame: Pose = Field(
        default=IDENTITY,
        description="Frame 0 of the table, whose z is the axis of the first joint, in the base frame. For a horizontal "
        "linear axis on the floor it is turned so that its z lies along the axis and the base's own z points up.",
        examples=[{"position": [0.0, 0.0, 0.2], "orientation": {"rpy": [0.0, pi / 2, 0.0]}}],
    )


Robot = Annotated[Annotated[Label, Tag("@name")] | Annotated[DhTable, Tag("@table")], Discriminator(_name_or_table)]


class LinearLimit(Strict):
    """A limit between joints: lower <= Σ c_j q_j <= upper, as arms with a parallelogram linkage have it."""

    coefficients: list[float] = Field(
        min_length=1,
        max_length=MOST_JOINTS,
        description="c, one per joint from the base to the flange: 0 for joints that have no part in it, as a linear "
        "axis has none, else between 0.01 and 100 on either side of 0.",
        examples=[[0.0, 1.0, 1.0, 0.0, 0.0, 0.0]],
    )
    lower: float = Field(description="rad; joint values count with their turns.", examples=[-1.2])
    upper: float = Field(description="rad, above lower.", examples=[1.9])
    name: Label | None = Field(
        default=None,
        min_length=1,
        description="What reasons and margins call it; null: the sum in joint names, such as `joint_2 + joint_3`.",
        examples=["forearm to the horizontal"],
    )


MOST_LINEAR_LIMITS = 8
"""Linear limits of one arm."""


class LinearLimitRows(Strict):
    """A list of them by itself, as a form has it."""

    linear_limits: list[LinearLimit] = Field(max_length=MOST_LINEAR_LIMITS, description="The rows.")


class Posture(Strict):
    """The branch of the inverse kinematics that is wanted; what is left out or null is free."""

    shoulder: Literal["left", "right"] | None = Field(
        default=None, description="Side of the shoulder.", examples=["left"]
    )
    elbow: Literal["up", "down"] | None = Field(default=None, description="Elbow up or down.", examples=["up"])
    wrist: Literal["flip", "noflip"] | None = Field(
        default=None, description="Sign of the wrist; puma560: flip is θ5 < 0.", examples=["noflip"]
    )


class Arm(Strict):
    """One of the arms that carry the object."""

    name: Label = Field(min_length=1, description="Label, unique in the request.", examples=["main"])
    robot: Robot = Field(
        description="Name of a robot of `GET /v1/robots`, or a Denavit-Hartenberg table.", examples=["puma560"]
    )
    robot_version: str | None = Field(
        default=None,
        min_length=1,
        max_length=64,
        description="Version of an uploaded robot, as `GET /v1/robots/{name}` shows it; null: the present one. It is "
        "filled in when the request is accepted.",
        examples=[None],
    )
    flange: Label | None = Field(
        default=None,
        min_length=1,
        description="Frame that `tool` and `tool_shapes` are given in, one of the `flanges` of "
        "`GET /v1/robots/{name}`. null: the first of them, `iso9787` for robots of the catalogue: the mechanical "
        "interface, z out of the flange. The last frame of the robot's description (`flange_frame`) is another.",
        examples=["iso9787"],
    )
    tool: Pose = Field(
        default=IDENTITY,
        description="Tool centre point (TCP) in the frame that `flange` names.",
        examples=[{"position": [0.0, 0.0, 0.12], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}],
    )
    grasp: Pose = Field(
        description="TCP in the object frame: where and how the arm holds the object.",
        examples=[{"position": [-0.06, -0.015, -0.02], "orientation": {"quaternion": [0.5, 0.5, 0.5, 0.5]}}],
    )
    tolerance: PoseTolerances | None = Field(
        default=None,
        description="What the poses leave open for this arm's tool: a roll, a cone, ranges of position and rotation; "
        "one for all poses, or a list of them for ranges of poses. What is chosen is in the result. null: every pose "
        "is given.",
        examples=[FREE_ROLL],
    )
    base: Base = Field(
        description="Where the base may stand.",
        examples=[{"x": [-1.0, 1.0], "y": [0.0, 2.0], "z": 0.0, "yaw": [-pi, pi]}],
    )
    mount: Mount = Field(
        default=FLOOR_MOUNT,
        description="Floor (default), ceiling, wall, or any fixed slope. The orientation of the base frame in the "
        "world is Ry(pitch) Rx(roll) Rz(yaw): the yaw turns about the base's own z axis.",
        examples=[{"roll": pi, "pitch": 0.0}],
    )
    pedestal: Pedestal | None = Field(
        default=None,
        description="A solid under the base that moves with it; null: none.",
        examples=[{"height": 0.6, "footprint": {"size": [0.4, 0.4]}}],
    )
    footprint: Footprint | None = Field(
        default=None,
        description="What the base covers of the floor; null: the footprint of its pedestal, or its origin alone.",
        examples=[{"radius": 0.2}],
    )
    tool_shapes: list[Solid] = Field(
        default=[],
        description="Solids of the tool in the frame that `flange` names. Half-spaces are refused.",
        examples=[[{"shape": CAPSULE}]],
    )
    reference: list[float] | None = Field(
        default=None,
        max_length=MOST_JOINTS,
        description="q* of the objective in rad (m for a linear axis), one per joint, inside the limits. null: the "
        "robot's own reference, usually mid-range. It does not restrict the posture.",
        examples=[[0.17, -0.39, 2.7, 0.52, 0.17, 0.17]],
    )
    weights: Weights = Field(
        default="range",
        description="Weights of the objective: 'range' (8.8), 'equal', or one number per joint, 0 or 1e-6 to 1e6: only "
        "their ratios matter. Joints without limits weigh 0 unless numbers are given.",
        examples=["range"],
    )
    posture: Posture | None = Field(
        default=None, description="Wanted posture; null: the best.", examples=[{"shoulder": "left", "elbow": "up"}]
    )
    limits: list[Interval] | None = Field(
        default=None,
        max_length=MOST_JOINTS,
        description="Joint limits [lower, upper] in rad (m for a linear axis), one pair per joint; null: the "
        "robot's own.",
        examples=[[[-2.79, 2.79], [-3.22, 0.78], [-0.78, 3.92], [-1.91, 2.96], [-1.74, 1.74], [-4.64, 4.64]]],
    )
    linear_limits: list[LinearLimit] | None = Field(
        default=None,
        max_length=MOST_LINEAR_LIMITS,
        description="Limits between joints, kept like those of single joints; null: the robot's own, []: none.",
        examples=[[{"coefficients": [0.0, 1.0, 1.0, 0.0, 0.0, 0.0], "lower": -1.2, "upper": 1.9}]],
    )
    min_conditioning: float | None = Field(
        default=None,
        ge=0.0,
        le=1.0,
        description="Smallest allowed σmin/σmax of the Jacobian along the path; null: only reported. A layout near a "
        "singularity is useless however large its margins.",
        examples=[0.05],
    )

    singularities: Literal["avoid", "allow"] = Field(
        default="avoid",
        description="avoid: a pose at which the wrist is within 0.001 rad of its singularity is not usable, for no "
        "controller follows a path there; allow: it is.",
        examples=["avoid"],
    )

    @property
    def robot_key(self) -> str | None:
        """What the robot is looked up by among those of users: its name, with the version if one is named."""
        if not isinstance(self.robot, str):
            return None
        return self.robot if self.robot_version is None else f"{self.robot}@{self.robot_version}"
