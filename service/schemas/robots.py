"""Robots of the catalogue and of users, as they are published in the OpenAPI document."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from duocell.service.schemas.base import Answer, Moment
from duocell.service.schemas.pose import Pose
from duocell.service.schemas.resources import ProblemDocument


class RobotSummary(Answer):
    """A robot in the list."""

    name: str = Field(description="To be used in requests.", examples=["ur10e"])
    title: str = Field(description="Model.", examples=["Universal Robots UR10e"])
    maker: str = Field(description="Manufacturer.", examples=["Universal Robots"])
    origin: Literal["catalogue", "uploaded"] = Field(
        description="Built in, or brought by a user; only those can be deleted.", examples=["catalogue"]
    )
    dof: int = Field(description="Number of joints.", examples=[6])
    reach: float = Field(
        description="m: a bound that the distance of the flange from the base frame's origin never exceeds, "
        "a few percent above the true extreme.",
        examples=[1.48],
    )
    geometry: Literal["mesh", "cited", "estimated"] = Field(
        description="Where the shape of the links comes from: the collision geometry of a URDF, measured with a "
        "source, or estimated from the kinematics.",
        examples=["cited"],
    )


class RobotPage(Answer):
    """All robots."""

    items: list[RobotSummary] = Field(description="The robots by name.")
    next_cursor: str | None = Field(description="Always null: the list is short.", examples=[None])


class Joint(Answer):
    """A joint of a robot."""

    name: str = Field(description="Its name.", examples=["shoulder_pan_joint"])
    type: Literal["revolute", "prismatic"] = Field(
        description="How it moves: its values are rad, or m if it is prismatic, the linear axis under an arm.",
        examples=["revolute"],
    )
    lower: float | None = Field(
        description="Lower limit in rad, or m; null if it turns without end.", examples=[-6.283]
    )
    upper: float | None = Field(description="Upper limit in rad, or m; null if it turns without end.", examples=[6.283])
    reference: float = Field(description="rad, or m; used where a request names no reference.", examples=[0.0])


class JointSum(Answer):
    """A limit between joints: lower <= Σ c_j q_j <= upper."""

    coefficients: list[float] = Field(description="c, one per joint.", examples=[[0.0, 1.0, 1.0, 0.0, 0.0, 0.0]])
    lower: float = Field(description="rad.", examples=[-1.2])
    upper: float = Field(description="rad.", examples=[1.9])
    name: str = Field(description="What reasons and margins call it.", examples=["joint_2 + joint_3"])


class LinkShape(Answer):
    """What is known of the shape of a link."""

    link: str = Field(description="The link.", examples=["forearm_link"])
    moves_with: str | None = Field(description="The joint that carries it; null: it stands.", examples=["elbow_joint"])
    pieces: int = Field(description="Convex bodies that stand for it.", examples=[3])


class TakenMesh(Answer):
    """A mesh of a URDF file."""

    filename: str = Field(
        description="What the URDF calls it.", examples=["package://arm_description/meshes/forearm.stl"]
    )
    file: str = Field(description="What was taken for it from the zip.", examples=["meshes/forearm.stl"])


class NamedFrame(Answer):
    """A frame at one end of a robot."""

    name: str = Field(
        description="`iso9787`: the mechanical interface of ISO 9787, z out of the flange.", examples=["iso9787"]
    )
    pose: Pose = Field(description="In the base frame.")
    source: str = Field(description="Where its place comes from.", examples=["tool0 of ROS-Industrial's package"])
    checked: str | None = Field(description="What a second source says of it; null: none was found.", examples=[None])


class ChainAlternative(Answer):
    """Another chain of a URDF file that could be meant."""

    base_link: str = Field(description="To be sent as `base_link` for it.", examples=["base_link"])
    tip: str = Field(description="To be sent as `tip` for it.", examples=["gripper_base"])
    joints: list[str] = Field(description="Its joints, from the base.", examples=[["joint_1", "joint_2"]])
    reason: str = Field(description="Why it was not chosen.", examples=["a tool, camera, sensor or collision link"])


class Chain(Answer):
    """The chain of a URDF file that was taken for the arm, by the rule in docs/robots.md."""

    base_link: str = Field(description="Link that became the base frame.", examples=["base_link"])
    tip: str = Field(description="Link that became the flange frame.", examples=["tool0"])
    joints: list[str] = Field(description="Its joints, from the base.", examples=[["joint_1", "joint_2"]])
    reason: str = Field(description="Why it was chosen.", examples=["tool0 has a flange's name."])
    left_out: list[str] = Field(
        description="What hangs below the base or behind the flange and is not part of the arm.",
        examples=[["Below the base base_link and not part of the arm: world."]],
    )
    alternatives: list[ChainAlternative] = Field(description="What else could be meant.")


class RobotDetail(RobotSummary):
    """All there is to know about a robot."""

    version: str | None = Field(
        description="Digest of the files that an uploaded robot was made from; null: of the catalogue.", examples=[None]
    )
    created_at: Moment | None = Field(
        description="RFC 3339, when it was uploaded; null: of the catalogue.", examples=["2026-11-22T09:30:00.000000Z"]
    )
    joints: list[Joint] = Field(description="From the base to the flange.")
    linear_limits: list[JointSum] = Field(
        description="Limits between joints that are in force unless a request names others.", examples=[[]]
    )
    chain: Chain | None = Field(
        description="Which chain of an uploaded URDF file the robot is, and what else it could be; null: of the "
        "catalogue."
    )
    reference_source: str = Field(description="Where the reference comes from.", examples=["mid-range"])
    base_frame: str = Field(
        description="Name of the base frame, which a layout places: `base_link` of an upload.", examples=["base_link"]
    )
    flange_frame: str = Field(
        description="Name of the last frame of the robot's description, one of its flanges: `tip` of an upload.",
        examples=["tool0"],
    )
    flanges: list[NamedFrame] = Field(
        description="Frames that a tool can be attached to (`flange` of an arm), the one that is taken unless another "
        "is named first; poses in the base frame with all joints at zero."
    )
    mounting_face: NamedFrame | None = Field(
        description="The face that the base is bolted down with, in the base frame; null where it is not known."
    )
    flange_at_zero: Pose = Field(description="Flange in the base frame with all joints at zero.")
    postures: dict[str, dict[str, str]] | None = Field(
        description="What the names of postures mean for this robot: key, name -> definition; null if it has none.",
        examples=[{"wrist": {"flip": "joint 5 below zero", "noflip": "joint 5 above zero"}}],
    )
    inverse_kinematics: str = Field(
        description="How joint values are found for a pose, and whether all of them are.",
        examples=["closed form (spherical wrist), all eight branches"],
    )
    bodies: list[LinkShape] = Field(description="The shape of the links, from the base outwards.")
    meshes: list[TakenMesh] = Field(description="Meshes of an uploaded robot; empty for the catalogue.")
    notes: list[str] = Field(
        description="Where the mounting face is, open limits, and other remarks.",
        examples=[["The base frame is base_link, at the mounting face."]],
    )
    source: str = Field(description="Where geometry and limits come from.", examples=["ssik 8.2.0"])
    licence: str = Field(description="Licence of that source.", examples=["BSD-3-Clause"])


class RobotImport(Answer):
    """An upload that is read in the background."""

    id: str = Field(description="Of the upload.", examples=["5f0c9a7d8e3b4c21a6f7d0e9b8c7a6f5"])
    name: str = Field(description="Name that the robot is to have.", examples=["my_arm"])
    status: Literal["reading", "succeeded", "failed"] = Field(description="Where it stands.", examples=["reading"])
    link: str | None = Field(
        description="Link whose meshes are taken apart now; null before and after that.", examples=["upper_arm"]
    )
    links_done: int = Field(description="Links with meshes that are finished.", examples=[2])
    links_total: int = Field(description="Links with meshes; 0 until that is known.", examples=[7])
    robot: str | None = Field(description="Address of the robot, once it is there.", examples=["/v1/robots/my_arm"])
    problem: ProblemDocument | None = Field(description="Why it failed; null if it did not.")
    href: str = Field(
        description="Address of this resource.", examples=["/v1/imports/5f0c9a7d8e3b4c21a6f7d0e9b8c7a6f5"]
    )
