"""Images of a cell in which every layout is an image of a layout of the cell, with the same objective."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any, cast

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.floor import Floor
from duocell.models.cell.surroundings import Surroundings
from duocell.models.cell.task import Task
from duocell.models.robot.arm import Arm, BaseRegion, Interval

QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
"""Exact cosines and sines of quarter turns."""
FARTHEST = 10.0
"""m; how far a cell is shifted along each axis at most."""


def images(cell: Cell, rng: np.random.Generator) -> dict[str, Cell]:
    """Six images by name: three turns, a shift, poses in reverse, arms and obstacles in reverse.

    Where there is nothing but one arm, the last one is a second shift.
    """
    shifts = rng.uniform(-FARTHEST, FARTHEST, (2, 3))
    made = {f"turned {90 * quarters}": moved(cell, quarters, np.zeros(3)) for quarters in (1, 2, 3)}
    made["shifted"] = moved(cell, 0, shifts[0])
    made["poses reversed"] = reversed_poses(cell)
    if len(cell.arms) > 1 or len(cell.surroundings.obstacles) > 1:
        made["arms reversed"] = reversed_arms(reversed_obstacles(cell))
    else:
        made["shifted again"] = moved(cell, 0, shifts[1])
    return made


def moved(cell: Cell, quarters: int, shift: Floats) -> Cell:
    """Turned by quarters about the vertical through the origin, then shifted by (3,) m, with all that stands there."""
    frame = transform(_turn(quarters), shift)
    around = cell.surroundings
    obstacles = tuple(replace(body, pose=frame @ body.pose) for body in around.obstacles)
    floor = None if around.floor is None else _moved_floor(around.floor, frame)
    return replace(
        cell,
        task=replace(cell.task, poses=frame @ cell.task.poses),
        arms=tuple(_moved_arm(arm, frame, quarters) for arm in cell.arms),
        surroundings=replace(around, obstacles=obstacles, floor=floor),
        couplings=tuple(_moved_coupling(tie, frame, quarters) for tie in cell.couplings),
    )


def reversed_poses(cell: Cell) -> Cell:
    """Poses, and so segments, from the last to the first."""
    task = cell.task
    starts = tuple(len(task) - segment.stop for segment in reversed(task.segments))
    back = Task(task.poses[::-1], starts, task.names[::-1], task.weights[::-1])
    arms = tuple(arm if arm.grasps is None else replace(arm, grasps=arm.grasps[::-1]) for arm in cell.arms)
    return replace(cell, task=back, arms=arms)


def reversed_arms(cell: Cell) -> Cell:
    """The last arm first; couplings are between the same arms as before."""
    last = len(cell.arms) - 1
    ties = tuple(_replaced(tie, arms=tuple(last - index for index in tie.arms)) for tie in cell.couplings)
    return replace(cell, arms=cell.arms[::-1], couplings=ties)


def reversed_obstacles(cell: Cell) -> Cell:
    """The last obstacle, and the last forbidden polygon of the floor, first."""
    around: Surroundings = cell.surroundings
    floor = around.floor if around.floor is None else replace(around.floor, forbidden=around.floor.forbidden[::-1])
    return replace(cell, surroundings=replace(around, obstacles=around.obstacles[::-1], floor=floor))


def _turn(quarters: int) -> Floats:
    cosine, sine = QUARTERS[quarters % 4]
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _moved_arm(arm: Arm, frame: Floats, quarters: int) -> Arm:
    """Its region turned along; an upright base turns by its yaw, another one by its mount."""
    corners = arm.base.bounds[:3].T @ frame[:3, :3].T + frame[:3, 3]
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y, z = (Interval(float(a), float(b)) for a, b in zip(low, high, strict=True))
    yaw, mount = arm.base.yaw, arm.mount
    if not arm.upright:
        mount = frame[:3, :3] @ mount
    elif not arm.base.yaw_free:
        yaw = Interval(yaw.low + quarters * pi / 2.0, yaw.high + quarters * pi / 2.0)
    return replace(arm, base=BaseRegion(x, y, z, yaw), mount=mount)


def _moved_floor(floor: Floor, frame: Floats) -> Floor:
    def along(polygon: Floats) -> Floats:
        corners: Floats = polygon @ frame[:2, :2].T + frame[:2, 3]
        return corners

    allowed = None if floor.allowed is None else along(floor.allowed)
    return Floor(allowed, tuple(along(polygon) for polygon in floor.forbidden), floor.margin)


def _moved_coupling(tie: Coupling, frame: Floats, quarters: int) -> Coupling:
    """Its direction and the point it passes through, where it has them."""
    given: dict[str, Any] = {}
    if hasattr(tie, "angle"):
        given["angle"] = tie.angle + quarters * pi / 2.0
    point = getattr(tie, "point", None)
    if point is not None:
        x, y = frame[:2, :2] @ np.array(point) + frame[:2, 3]
        given["point"] = (float(x), float(y))
    return _replaced(tie, **given)


def _replaced(tie: Coupling, **given: object) -> Coupling:
    """All kinds of couplings are dataclasses."""
    return cast(Coupling, replace(cast(Any, tie), **given))
