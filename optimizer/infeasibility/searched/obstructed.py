"""What no choice of bases can help: a part that hits something on its given way, and floors without room."""

from __future__ import annotations

from math import radians

import numpy as np
import shapely

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Footprint
from duocell.models.cell.surroundings import Clearances, PairClass, Surroundings
from duocell.models.collision.collision import CollisionModel, Configurations
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.path_samples import ObjectPath
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.reasons.meant_contact import if_meant
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.results.layout import Reason

SHIFT, TURN = 5e-3, radians(1.0)
"""m and rad between the samples of the object's way."""
SLACK = 1e-6
"""m, by which regions are widened, so that rounding never takes away the last place."""


def obstruction(cell: Cell) -> tuple[Reason, ...]:
    """Reasons that are proofs: no layout at all can do the task; empty if there are none."""
    return (*_part_hits(cell), *(reason for arm in cell.arms for reason in _no_room(cell, arm)))


def part_hits(cell: Cell) -> tuple[tuple[int, int, int], ...]:
    """Where the part comes too near to something: index of the obstacle, of the pose before and of the pose after."""
    required = cell.surroundings.clearances.part_obstacle
    if required is None or not _part_hits(cell):
        return ()
    step, model, places = _part_along(cell, required)
    at_pose = np.append(np.diff(step, prepend=-1)[:-1] > 0, True)
    step = np.where(np.arange(len(step)) == len(step) - 1, len(cell.task) - 1, step)
    numbers = {obstacle.name: k for k, obstacle in enumerate(cell.surroundings.obstacles)}
    hits = []
    for k, pair in np.argwhere(model.bounds(places) < required - KEPT):
        check_stop()
        last = int(step[k]) if at_pose[k] else int(step[k]) + 1
        hit = numbers[model.bodies.names[model.bodies.second[pair]]], int(step[k]), last
        if hit not in hits and model.contact(places, int(k), int(pair)).distance < required - KEPT:
            hits.append(hit)
    return tuple(hits)


def _part_along(cell: Cell, required: float) -> tuple[Ints, CollisionModel, Configurations]:
    """The part among the obstacles on its way: index of the pose before (K,), bodies, places."""
    around = cell.surroundings
    model = CollisionModel((), Surroundings(around.obstacles, around.part, None, Clearances(part_obstacle=required)))
    step, objects = _samples_along(cell)
    return step, model, model.configure(np.empty((0, 4, 4)), [], objects)


def _part_hits(cell: Cell) -> tuple[Reason, ...]:
    """The part's way is given, so is what it hits."""
    required = cell.surroundings.clearances.part_obstacle
    if required is None or cell.surroundings.part is None:
        return ()
    step, model, places = _part_along(cell, required)
    found = model.closest(places, PairClass.PART_OBSTACLE)
    if found is None or found[1].distance >= required - KEPT:
        return ()
    k, contact = found
    violation = required - contact.distance
    detail = (
        f"the part ({contact.first}) comes {contact.distance * 1e3:.1f} mm near {contact.second} after pose {step[k]}; "
        f"{required * 1e3:g} mm are asked for. No base can help: move the path or the obstacle"
        f"{if_meant(PairClass.PART_OBSTACLE)}"
    )
    return (Reason("", "collision", (int(step[k]),), detail, None, violation, "m"),)


def _samples_along(cell: Cell) -> tuple[Ints, Floats]:
    """Poses and samples between them: index of the pose before (K,), object frames (K, 4, 4)."""
    path = ObjectPath(cell.task.poses)
    apart = np.maximum(np.linalg.norm(path.shifts, axis=1) / SHIFT, np.linalg.norm(path.turns, axis=1) / TURN)
    cuts = np.where(cell.task.joined, np.maximum(np.ceil(apart), 1), 1).astype(np.int64)
    step = np.concatenate([np.repeat(np.arange(len(cuts)), cuts), [len(cuts) - 1]])
    fraction = np.concatenate([np.concatenate([np.arange(c) / c for c in cuts]), [1.0]])
    return step, path.at(step, fraction)


def _no_room(cell: Cell, arm: Arm) -> tuple[Reason, ...]:
    """Is there a place on the floor from which every pose is within reach? At the most favourable yaw."""
    floor = cell.surroundings.floor
    box = search_box(cell, arm)
    if floor is None or np.any(box[:, 0] > box[:, 1]):
        return ()
    free = shapely.box(box[0, 0], box[1, 0], box[0, 1], box[1, 1]).buffer(SLACK)  # fixed coordinates have no width
    keep = _inner_radius(cell.surroundings.footprint(arm.name)) + floor.margin
    if floor.allowed is not None:
        free = free.intersection(shapely.Polygon(floor.allowed).buffer(-keep))
    for polygon in floor.forbidden:
        free = free.difference(shapely.Polygon(polygon).buffer(keep))
    if not free.is_empty:
        return ()
    everywhere = tuple(range(len(cell.task)))
    detail = (
        f"{arm.name}: no place on the allowed floor lets it reach every pose from inside its base region; "
        "widen the region or the floor, or lessen the margin"
    )
    return (Reason(arm.name, "floor", everywhere, detail),)


def _inner_radius(footprint: Footprint) -> float:
    """Radius [m] of a disc about the base origin that the footprint covers at every yaw."""
    if len(footprint.corners) == 1:
        return footprint.radius
    outline = shapely.Polygon(footprint.corners)
    origin = shapely.Point(0.0, 0.0)
    return footprint.radius + (outline.exterior.distance(origin) if outline.contains(origin) else 0.0)
