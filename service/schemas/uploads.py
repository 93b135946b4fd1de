"""Forms that users send, and what is read from task files, as they are published in the OpenAPI document."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema
from pydantic.json_schema import SkipJsonSchema

from duocell.models.task_files.conventions import ROTATIONS, UNITS
from duocell.models.task_files.reading import FORMATS
from duocell.service.library.document_store import NAME
from duocell.service.schemas.base import Answer
from duocell.service.schemas.task import PosesTask

Upload = Annotated[
    bytes, WithJsonSchema({"type": "string", "format": "binary", "contentMediaType": "application/octet-stream"})
]
"""A file: OpenAPI 3.1 says so by its media type, and many generators of clients by the format."""


def _left_out(schema: dict[str, Any]) -> None:
    """A form has no null: what is not sent is left out."""
    for field in schema["properties"].values():
        field.pop("default", None)


_FORM = ConfigDict(extra="forbid", json_schema_extra=_left_out)


class RobotUpload(BaseModel):
    """A robot: a URDF file and the meshes of its collision geometry."""

    model_config = _FORM

    name: str = Field(
        pattern=f"^{NAME.pattern}$",
        description="What requests will call it; not the name of another robot.",
        examples=["my_arm"],
    )
    urdf: Upload = Field(
        description="The URDF file, at most 4 MB. Links, joints and `<collision>` elements count, nothing else does. "
        "Xacro is not expanded: send what `xacro arm.urdf.xacro` writes."
    )
    meshes: Upload | SkipJsonSchema[None] = Field(
        default=None,
        description="A zip with the STL, OBJ or COLLADA files that the collision geometry names. Each is looked for by "
        "the end of its path: `package://my_arm/meshes/base.stl` is found as `meshes/base.stl` or as `base.stl`.",
    )
    base_link: str | SkipJsonSchema[None] = Field(
        default=None,
        description="Link that becomes the base frame; left out: the first link of the arm, not `world` and its like. "
        "`chain` in the answer tells the choice and the alternatives.",
        examples=["base_link"],
    )
    tip: str | SkipJsonSchema[None] = Field(
        default=None,
        description="Link that becomes the flange; left out: the one called `tool0`, `flange`, `ee_link` or `tcp` "
        "behind 6 or 7 turning joints, else the last link there that is no tool, camera or sensor.",
        examples=["tool0"],
    )
    linear_limits: str | SkipJsonSchema[None] = Field(
        default=None,
        description="Limits between joints, which a URDF cannot tell: JSON as `linear_limits` of an arm.",
        examples=['[{"coefficients": [0, 1, 1, 0, 0, 0], "lower": -1.2, "upper": 1.9}]'],
    )
    missing_meshes: Literal["refuse", "estimate"] | SkipJsonSchema[None] = Field(
        default=None,
        description="What becomes of links whose mesh is missing or unreadable; left out: `refuse`. `estimate`: "
        "capsules along the kinematic chain stand for them, and `geometry` is `estimated`.",
        examples=["estimate"],
    )


class MeshUpload(BaseModel):
    """A solid: an STL, OBJ or COLLADA file."""

    model_config = _FORM

    mesh: Upload = Field(
        description="The file; its name ends in .stl, .obj or .dae. Units are up to you (a .dae file tells its own, "
        "and is taken in metres): shapes have a scale."
    )
    name: str | SkipJsonSchema[None] = Field(
        default=None, max_length=200, description="Label; left out: the name of the file.", examples=["fixture"]
    )


def _one_of(words: Iterable[str]) -> dict[str, Any]:
    return {"enum": list(words)}


class TaskUpload(BaseModel):
    """A task: a table, a list, a message, a robot program or a tool path."""

    model_config = _FORM

    file: Upload = Field(
        description="The file. The suffix of its name tells what it is: "
        + "; ".join(f"{', '.join(kind.suffixes)} {kind.title}" for kind in FORMATS.values())
        + ". Another one is looked into."
    )
    format: str | SkipJsonSchema[None] = Field(
        default=None,
        description="What kind of file it is; left out: as above.",
        examples=["kuka"],
        json_schema_extra=_one_of(FORMATS),
    )
    units: str | SkipJsonSchema[None] = Field(
        default=None,
        description="Of lengths; left out: as the format or the columns say, otherwise guessed, and told.",
        examples=["mm"],
        json_schema_extra=_one_of(UNITS),
    )
    rotation: str | SkipJsonSchema[None] = Field(
        default=None,
        description="How orientations are written; left out: as the format or the columns say. "
        + "; ".join(f"{name}: {convention.words}" for name, convention in ROTATIONS.items())
        + ".",
        examples=["rpy_deg"],
        json_schema_extra=_one_of(ROTATIONS),
    )
    columns: str | SkipJsonSchema[None] = Field(
        default=None,
        description="Names of the columns of a table or list without names, separated by commas.",
        examples=["x,y,z,qx,qy,qz,qw"],
    )
    tolerance: float | SkipJsonSchema[None] = Field(
        default=None,
        gt=0.0,
        description="m: way-points are left out that are within it, and within angle_tolerance, of the way between "
        "those that are kept; arcs become chords within it. Left out: all way-points are kept, arcs to 0.1 mm.",
        examples=[0.0005],
    )
    angle_tolerance: float | SkipJsonSchema[None] = Field(
        default=None,
        gt=0.0,
        description="rad, beside tolerance; left out: 0.01.",
        examples=[0.01],
    )


class UnderstoodFile(Answer):
    """What a task file was taken for."""

    format: str = Field(description="Kind of file.", examples=["csv"])
    units: str = Field(description="Of its lengths.", examples=["mm"])
    rotation: str = Field(description="How its orientations are written.", examples=["rpy_deg"])
    columns: list[str] = Field(
        description="Of a table, as they were read; empty for other files.",
        examples=[["x", "y", "z", "roll", "pitch", "yaw"]],
    )
    free_roll: bool = Field(
        description="Only the axis of the tool is given: what turns about the z axis of the poses was chosen so that "
        "it changes least, and may be anything.",
        examples=[False],
    )
    read: int = Field(description="Way-points of the file.", examples=[1200])
    kept: int = Field(description="Poses of the task.", examples=[85])
    position_error: float = Field(
        description="m, how far a way-point that was left out is from the way at most.", examples=[0.00047]
    )
    rotation_error: float = Field(description="rad, likewise.", examples=[0.0021])
    guessed: list[str] = Field(
        description="What the file does not say, and how it was taken; empty if it says everything.",
        examples=[["The unit is mm, since the largest coordinate is 820."]],
    )
    notes: list[str] = Field(
        description="What was left out, or needs to be known.",
        examples=[["2 targets were left out: they are joint values, not poses."]],
    )


class ImportedTask(Answer):
    """A task that was read from a file."""

    task: PosesTask = Field(description="To be put into a request as it is.")
    understood: UnderstoodFile = Field(description="What the file was taken for.")
