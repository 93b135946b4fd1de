"""Base regions from which poses are out of reach, and floors without room for a base: proofs without any posture."""

from __future__ import annotations

import numpy as np
import shapely

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.robot.arm import Arm
from duocell.optimizer.certificate.bounds.angles.targets import Targets
from duocell.optimizer.certificate.bounds.region import reachable_region
from duocell.optimizer.infeasibility.immediate.cause import SURE, Infeasibility
from duocell.optimizer.reasons.reasons import explain_reach
from duocell.optimizer.reduction.box import reach_windows, search_box
from duocell.optimizer.reduction.reduced import reduced_problem

HALVINGS = 24
"""Of a margin."""
FINE = 16
"""Segments of a quarter circle, on the side that leaves more room."""


def region_conflicts(cell: Cell) -> tuple[Infeasibility, ...]:
    """Arms that reach not every pose from any base of their region."""
    found = []
    for a, arm in enumerate(cell.arms):
        box = search_box(cell, arm)
        if np.any(box[:, 0] > box[:, 1]):
            reasons = explain_reach(cell, arm)
            found += [
                Infeasibility(r.kind, r.detail, (a,), r.poses, missing=r.amount, pointer=f"/arms/{a}/base", unit=r.unit)
                for r in reasons
            ]
        elif not arm.upright:
            found += _tilted(cell, a)
    return tuple(found)


def _tilted(cell: Cell, a: int) -> list[Infeasibility]:
    """The same for mounts that are not upright, where the windows along the world's axes are loose."""
    arm = cell.arms[a]
    problem = reduced_problem(cell, arm)
    if problem is None:
        return []
    region = reachable_region(Targets.of(problem), arm.base.bounds[:3])
    if not region.empty:
        return []
    poses = tuple(int(j) for j in np.flatnonzero(region.culprits))
    missing = float(np.max(region.low - region.high))
    numbers = ", ".join(map(str, poses[:8]))
    detail = (
        f"{arm.name}: no allowed base reaches poses {numbers}, at least {missing:.3f} m are missing; enlarge the base "
        "region, shorten the path or choose a longer robot"
    )
    return [Infeasibility("out_of_reach", detail, (a,), poses, missing=missing, pointer=f"/arms/{a}/base", unit="m")]


def floor_conflicts(cell: Cell) -> tuple[Infeasibility, ...]:
    """Arms for which the floor has no room where they reach every pose, whatever the yaw."""
    floor = cell.surroundings.floor
    if floor is None:
        return ()
    found = []
    for a, arm in enumerate(cell.arms):
        box, inner = search_box(cell, arm), inner_radius(cell.surroundings.footprint(arm.name))
        if np.all(box[:, 0] <= box[:, 1]) and free_floor(floor, inner, floor.margin, box).is_empty:
            found.append(_no_room(cell, a, floor, inner, box))
    return tuple(found)


def free_floor(floor: Floor, inner: float, margin: float, box: Floats | None) -> shapely.Geometry:
    """Where the origin of a base may be; never less than what there is.

    Args:
        floor: allowed and forbidden. inner: m, radius of a disc about the origin that the footprint covers.
        margin: m. box: (2 or 3, 2) m that holds the base, or None for anywhere.
    """
    keep = max(inner + margin - KEPT - SURE, 0.0)
    if box is None:
        free: shapely.Geometry = shapely.box(-1e4, -1e4, 1e4, 1e4)
    else:  # fixed coordinates have no width
        free = shapely.box(box[0, 0], box[1, 0], box[0, 1], box[1, 1]).buffer(KEPT + SURE)
    if floor.allowed is not None:
        free = free.intersection(shapely.Polygon(floor.allowed).buffer(-keep, quad_segs=FINE))
    for polygon in floor.forbidden:
        free = free.difference(shapely.Polygon(polygon).buffer(keep, quad_segs=FINE))
    return free


def inner_radius(footprint: Footprint) -> float:
    """Radius [m] of a disc about the base origin that the footprint covers at every yaw."""
    if len(footprint.corners) == 1:
        return footprint.radius
    outline, origin = shapely.Polygon(footprint.corners), shapely.Point(0.0, 0.0)
    return footprint.radius + (float(outline.exterior.distance(origin)) if outline.contains(origin) else 0.0)


def _no_room(cell: Cell, a: int, floor: Floor, inner: float, box: Floats) -> Infeasibility:
    """In words, with the smallest change of margin, region or floor that would leave some room."""
    arm = cell.arms[a]
    helps, possible = [], None
    if not free_floor(floor, inner, 0.0, box).is_empty:
        possible = _largest_margin(floor, inner, box)
        helps.append(f"ask for a margin of {1e3 * possible:.0f} mm instead of {1e3 * floor.margin:.0f} mm")
    reached = _within_reach(cell, arm)
    free = free_floor(floor, inner, floor.margin, reached)
    if not free.is_empty:
        region = arm.base.bounds[:2]
        farther = free.distance(shapely.box(region[0, 0], region[1, 0], region[0, 1], region[1, 1]))
        helps.append(f"let it stand {farther:.3f} m farther out of its base region")
    anywhere = free_floor(floor, inner, floor.margin, None)
    if not anywhere.is_empty:
        off = anywhere.distance(shapely.box(box[0, 0], box[1, 0], box[0, 1], box[1, 1]))
        helps.append(f"free the floor {off:.3f} m farther towards the task")
    detail = (
        f"{arm.name}: no place on the allowed floor lets it reach every pose from inside its base region, whatever its "
        f"yaw: {', or '.join(helps) or 'widen the floor'}"
    )
    return Infeasibility(
        kind="floor",
        detail=detail,
        arms=(a,),
        poses=tuple(range(len(cell.task))),
        required=floor.margin if possible is not None else None,
        possible=possible,
        missing=floor.margin - possible if possible is not None else None,
        pointer="/floor/margin" if possible is not None else "/floor",
        unit="m",
    )


def _largest_margin(floor: Floor, inner: float, box: Floats) -> float:
    """m; a larger one leaves no room."""
    low, high = 0.0, floor.margin
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if free_floor(floor, inner, middle, box).is_empty else (middle, high)
    return float(np.floor(1e3 * low) / 1e3)


def _within_reach(cell: Cell, arm: Arm) -> Floats:
    """(3, 2) m, what holds every base from which all poses are within reach, allowed or not."""
    windows = reach_windows(cell, arm)
    low, high = np.max(windows[:, :, 0], axis=0), np.min(windows[:, :, 1], axis=0)
    return np.stack([low, np.maximum(low, high)], axis=-1)
