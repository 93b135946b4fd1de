"""Forms that users send, as they are published in the OpenAPI document."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema
from pydantic.json_schema import SkipJsonSchema

from duocell.service.library.document_store import NAME

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
