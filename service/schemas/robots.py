"""Robots of the catalogue, as they are published in the OpenAPI document."""

from __future__ import annotations

from pydantic import Field

from service.schemas.base import Answer
from service.schemas.pose import Pose


class RobotSummary(Answer):
    """A robot in the list."""

    name: str = Field(description="To be used in requests.", examples=["ur10e"])
    title: str = Field(description="Model.", examples=["Universal Robots UR10e"])
    maker: str = Field(description="Manufacturer.", examples=["Universal Robots"])
    dof: int = Field(description="Number of joints.", examples=[6])
    reach: float = Field(
        description="m: a bound that the distance of the flange from the base frame's origin never exceeds, "
        "a few percent above the true extreme.",
        examples=[1.48],
    )


class RobotPage(Answer):
    """All robots."""

    items: list[RobotSummary] = Field(description="The robots by name.")
    next_cursor: str | None = Field(description="Always null: the list is short.", examples=[None])


class Joint(Answer):
    """A joint of a robot."""

    name: str = Field(description="Its name.", examples=["shoulder_pan_joint"])
    lower: float | None = Field(description="Lower limit in rad; null if it turns without end.", examples=[-6.283])
    upper: float | None = Field(description="Upper limit in rad; null if it turns without end.", examples=[6.283])
    reference: float = Field(description="rad, used where a request names no reference.", examples=[0.0])


class RobotDetail(RobotSummary):
    """All there is to know about a robot."""

    joints: list[Joint] = Field(description="From the base to the flange.")
    reference_source: str = Field(description="Where the reference comes from.", examples=["mid-range"])
    base_frame: str = Field(description="Name of the base frame, which a layout places.", examples=["base_link"])
    flange_frame: str = Field(description="Name of the flange frame, to which a tool is attached.", examples=["tool0"])
    flange_at_zero: Pose = Field(description="Flange in the base frame with all joints at zero.")
    postures: dict[str, dict[str, str]] | None = Field(
        description="What the names of postures mean for this robot: key, name -> definition; null if it has none.",
        examples=[{"wrist": {"flip": "joint 5 below zero", "noflip": "joint 5 above zero"}}],
    )
    inverse_kinematics: str = Field(
        description="How joint values are found for a pose, and whether all of them are.",
        examples=["closed form (spherical wrist), all eight branches"],
    )
    notes: list[str] = Field(
        description="Where the mounting face is, open limits, and other remarks.",
        examples=[["The base frame is base_link, at the mounting face."]],
    )
    source: str = Field(description="Where geometry and limits come from.", examples=["ssik 8.2.0"])
    licence: str = Field(description="Licence of that source.", examples=["BSD-3-Clause"])
