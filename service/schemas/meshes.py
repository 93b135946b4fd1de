"""Uploaded meshes, as they are published in the OpenAPI document."""

from __future__ import annotations

from pydantic import Field

from duocell.service.schemas.base import Answer, Moment, Vector3

_ID = "9f86d081884c7d659a2feaa0c55ad015"


class BoundingBox(Answer):
    """The smallest box along the axes of the file that holds the mesh."""

    lower: Vector3 = Field(description="Least x, y, z in the units of the file.", examples=[[-50.0, -50.0, 0.0]])
    upper: Vector3 = Field(description="Greatest x, y, z in the units of the file.", examples=[[50.0, 50.0, 120.0]])


class UploadedMesh(Answer):
    """A solid that was uploaded."""

    id: str = Field(description="Identifier: a digest of the file. Shapes of requests refer to it.", examples=[_ID])
    name: str = Field(description="Label; the name of the file if none was given.", examples=["fixture"])
    format: str = Field(description="Of the file: stl, obj or dae.", examples=["stl"])
    size: int = Field(description="Bytes of the file.", examples=[60_084])
    triangles: int = Field(description="Number of triangles.", examples=[1200])
    bounding_box: BoundingBox = Field(
        description="Where it is, in the units of the file: does it need a scale of 0.001?"
    )
    pieces: int = Field(description="Convex pieces that stand for it; together they contain it.", examples=[7])
    depth: float | None = Field(
        description="Deepest dent that the pieces fill, in the units of the file, as sampled: so far they stick out of "
        "the mesh. null: not kept when it was uploaded.",
        examples=[1.5],
    )
    left_out: int = Field(
        description="Flat parts of the file that have no volume and stick out of the pieces: nothing keeps clear "
        "of them.",
        examples=[0],
    )
    created_at: Moment = Field(description="RFC 3339.", examples=["2026-11-22T09:30:00.000000Z"])
    href: str = Field(description="Address of this resource.", examples=[f"/v1/meshes/{_ID}"])


class MeshPage(Answer):
    """All meshes."""

    items: list[UploadedMesh] = Field(description="The meshes by name.")
    next_cursor: str | None = Field(description="Always null: the list is short.", examples=[None])
