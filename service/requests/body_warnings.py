"""What may be a slip in solids and base regions: millimetres, and regions beside the task."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.service.common.issues import Issue
from duocell.service.schemas.request import LayoutRequest
from duocell.service.schemas.shapes import Obstacle, Solid

FAR = 20.0
"""m; robots reach a fifth of it, cells are seldom larger."""
LARGE = 100.0
"""m; longer than a floor or a wall that somebody models. A hand's breadth in millimetres is more."""
HIGH = 10.0
"""m; nobody stands an arm on a higher pedestal."""


def body_warnings(request: LayoutRequest) -> Iterator[Issue]:
    """One warning for all solids: that of the largest number that may be in millimetres.

    Args:
        request: as accepted.
    """
    found = [(value, at, FAR) for at, values in _places(request) for value in values]
    found += [(value, at, LARGE) for at, values in _sizes(request) for value in values]
    found += [
        (arm.pedestal.height, f"/arms/{index}/pedestal/height", HIGH)
        for index, arm in enumerate(request.arms)
        if arm.pedestal is not None and arm.pedestal.height is not None
    ]
    beyond = [(abs(value) / most, value, at) for value, at, most in found if abs(value) > most]
    if beyond:
        _, value, at = max(beyond)
        yield Issue(at, f"{value:g} m is far for a cell. Did you mean {value / 1e3:g} m ({value:g} mm)?")


def _solids(request: LayoutRequest) -> Iterator[tuple[str, Solid | Obstacle]]:
    """Every solid, with its place."""
    yield from ((f"/obstacles/{index}", solid) for index, solid in enumerate(request.obstacles))
    if request.part is not None:
        yield from ((f"/part/shapes/{index}", solid) for index, solid in enumerate(request.part.shapes))
    for index, arm in enumerate(request.arms):
        yield from ((f"/arms/{index}/tool_shapes/{k}", solid) for k, solid in enumerate(arm.tool_shapes))


def _places(request: LayoutRequest) -> Iterator[tuple[str, list[float]]]:
    """Where solids are, m."""
    yield from ((f"{at}/pose/position", solid.pose.position) for at, solid in _solids(request))


def _sizes(request: LayoutRequest) -> Iterator[tuple[str, list[float]]]:
    """Lengths of solids, m; those of meshes are judged when they are uploaded."""
    for at, solid in _solids(request):
        for name in ("size", "radius", "length"):
            value = getattr(solid.shape, name, None)
            if value is not None:
                yield f"{at}/shape/{name}", value if isinstance(value, list) else [value]


def region_warnings(cell: Cell, layout: Layout) -> Iterator[Issue]:
    """Base regions from which not one pose is within reach: they lie beside the task.

    Args:
        cell: that was asked for. layout: the answer.
    """
    if layout.outcome is not Outcome.INFEASIBLE:
        return
    every = tuple(range(len(cell.task)))
    lost = {reason.arm for reason in layout.reasons if reason.kind == "out_of_reach" and reason.poses == every}
    for index, arm in enumerate(cell.arms):
        if arm.name in lost:
            points = (cell.task.poses @ cell.grasps(arm))[:, :3, 3]
            where = ", ".join(
                f"{axis} {low:.4g} to {high:.4g} m"
                for axis, low, high in zip("xyz", np.min(points, axis=0), np.max(points, axis=0), strict=True)
            )
            detail = f"No pose is within reach from where this base may stand. The TCP moves within {where}."
            yield Issue(f"/arms/{index}/base", detail)
