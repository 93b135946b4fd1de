"""How many convex pieces the meshes of a request stand for: a few bytes may name a mesh of thousands, many times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.schemas.request import LayoutRequest
from duocell.service.schemas.shapes import Mesh, Shape
from duocell.service.settings import Limits
from duocell.service.validation.count_limits import CODE


class MeshCounts(Protocol):
    """Where the numbers of pieces are known."""

    def pieces(self, mesh_id: str) -> int:
        """Convex pieces of a mesh; 0 if there is no such mesh."""
        ...


def check_pieces(request: LayoutRequest, meshes: MeshCounts, limits: Limits) -> None:
    """Refuse meshes that stand for too many pieces together, before any of them is looked at.

    Raises:
        InvalidRequest: too many; one issue, at the mesh with most of them.
    """
    named = list(_named(request))
    counts: Mapping[str, int] = {mesh_id: meshes.pieces(mesh_id) for mesh_id in {mesh_id for _, mesh_id in named}}
    total = sum(counts[mesh_id] for _, mesh_id in named)
    if total <= limits.max_pieces:
        return
    pointer, largest = max(named, key=lambda place: counts[place[1]])
    detail = (
        f"The meshes of the request stand for {total} convex pieces, {counts[largest]} of them here; allowed are "
        f"{limits.max_pieces} (DUOCELL_MAX_PIECES). Send simpler meshes, or boxes and cylinders that contain them."
    )
    raise InvalidRequest([Issue(pointer, detail, CODE)])


def _named(request: LayoutRequest) -> Iterator[tuple[str, str]]:
    """Place and identifier of every mesh that is named."""
    for pointer, shape in _shapes(request):
        if isinstance(shape, Mesh):
            yield pointer, shape.id


def _shapes(request: LayoutRequest) -> Iterator[tuple[str, Shape]]:
    for index, obstacle in enumerate(request.obstacles):
        yield f"/obstacles/{index}/shape/id", obstacle.shape
    for index, solid in enumerate(request.part.shapes if request.part is not None else []):
        yield f"/part/shapes/{index}/shape/id", solid.shape
    for a, arm in enumerate(request.arms):
        for index, solid in enumerate(arm.tool_shapes):
            yield f"/arms/{a}/tool_shapes/{index}/shape/id", solid.shape
