"""Shapes of a request as solids of the models; an uploaded mesh becomes several."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.cell.floor import Footprint as ModelFootprint
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Sphere
from duocell.models.geometry.shapes import Shape as ModelShape
from duocell.service.common.issues import IssueCollector
from duocell.service.requests.convert_pose import pose_of
from duocell.service.schemas import shapes as schema
from duocell.service.schemas.shapes import Obstacle, Shape, Solid
from duocell.service.schemas.surroundings import Footprint, RectangularFootprint, RoundFootprint


class MeshSource(Protocol):
    """Where uploaded meshes are kept."""

    def hulls(self, mesh_id: str, scale: float = 1.0) -> Sequence[ConvexHull]:
        """The convex pieces of a mesh.

        Args:
            mesh_id: its identifier.
            scale: factor to m.

        Raises:
            InvalidInput: there is no such mesh, or not at this scale.
        """
        ...


class NoMeshes:
    """The source of a place where nothing can be uploaded."""

    def hulls(self, mesh_id: str, scale: float = 1.0) -> Sequence[ConvexHull]:
        """See `MeshSource`."""
        raise InvalidInput(
            f"there is no mesh {mesh_id[:60]!r}: none is kept here. Send boxes, cylinders or capsules.", "/id"
        )


NO_MESHES = NoMeshes()


def obstacles_of(obstacles: list[Obstacle], meshes: MeshSource, issues: IssueCollector) -> tuple[Body, ...]:
    """Obstacles as bodies with different names; the pieces of a mesh are numbered."""
    given = [obstacle.name for obstacle in obstacles]
    taken = set(given)
    bodies: list[Body] = []
    for index, obstacle in enumerate(obstacles):
        pointer = f"/obstacles/{index}"
        if obstacle.name in given[:index]:
            issues.add(
                f"{pointer}/name",
                f"Another obstacle is called {obstacle.name!r} too; names must be unique. Rename one of them.",
            )
        for piece, body in enumerate(_bodies(obstacle.name, obstacle, pointer, meshes, issues)):
            name = obstacle.name if piece == 0 else _unused(f"{obstacle.name} piece {piece + 1}", taken)
            taken.add(name)
            bodies.append(Body(name, body.pose, body.shape))
    return tuple(bodies)


def solids_of(
    solids: list[Solid], name: str, pointer: str, meshes: MeshSource, issues: IssueCollector
) -> tuple[Body, ...]:
    """Solids that are carried or mounted, as bodies of one name: half-spaces are refused."""
    bodies: list[Body] = []
    for index, solid in enumerate(solids):
        if isinstance(solid.shape, schema.HalfSpace):
            issues.add(
                f"{pointer}/{index}/shape/type", "A half-space has no end and cannot be carried about. Send a box."
            )
            continue
        bodies += _bodies(name, solid, f"{pointer}/{index}", meshes, issues)
    return tuple(bodies)


def footprint_of(footprint: Footprint, pointer: str, issues: IssueCollector) -> ModelFootprint | None:
    """A footprint, or None if issues had to be noted."""
    with issues.at(pointer, {"/corners": "/polygon"}):
        if isinstance(footprint, RectangularFootprint):
            return ModelFootprint.rectangle(*footprint.size)
        if isinstance(footprint, RoundFootprint):
            return ModelFootprint.disc(footprint.radius)
        return ModelFootprint.polygon(footprint.polygon)
    return None


def _bodies(
    name: str, solid: Solid | Obstacle, pointer: str, meshes: MeshSource, issues: IssueCollector
) -> Iterable[Body]:
    """The bodies of one shape; none if issues had to be noted."""
    pose: Floats = pose_of(solid.pose, f"{pointer}/pose", issues)
    shapes: Sequence[ModelShape] = ()
    with issues.at(f"{pointer}/shape"):
        shapes = _shapes(solid.shape, meshes)
    bodies: list[Body] = []
    with issues.at(pointer):
        bodies = [Body(name, pose, shape) for shape in shapes]
    return bodies


def _shapes(shape: Shape, meshes: MeshSource) -> Sequence[ModelShape]:
    match shape:
        case schema.Box():
            return (Box(np.array(shape.size)),)
        case schema.Sphere():
            return (Sphere(shape.radius),)
        case schema.Cylinder():
            return (Cylinder(shape.radius, shape.length),)
        case schema.Capsule():
            return (Capsule(shape.radius, shape.length),)
        case schema.HalfSpace():
            return (HalfSpace(),)
        case _:
            return meshes.hulls(shape.id, shape.scale)


def _unused(name: str, taken: set[str]) -> str:
    """The name, or the next one of its kind that nobody has."""
    while name in taken:
        name += "'"
    return name
