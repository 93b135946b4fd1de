"""What a floor plan shows besides task and arms: obstacles, the floor that is free, pedestals, the part's outline."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull as Hull

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Sphere

OBSTACLE, FLOOR = "#8a8a8a", "#4d4d4d"
ROUND = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
UPRIGHT = 1e-6
"""Largest |z| of the normal of a half-space that is a wall."""


def outline(body: Body, frame: Floats) -> Floats:
    """(k, 2) m, corners of a body's shadow on the floor, counter-clockwise.

    Args:
        body: any but a half-space. frame: (4, 4) of the frame it belongs to, in the world.
    """
    pose = frame @ body.pose
    points = _points(body, pose[:3, :3]) @ pose[:3, :3].T + pose[:3, 3]
    flat = points[:, :2]
    corners: Floats = flat[Hull(flat).vertices]
    return corners


def _points(body: Body, rotation: Floats) -> Floats:
    """(k, 3) m, points in the shape's frame whose shadow has the shape's outline."""
    circle = np.column_stack([np.cos(ROUND), np.sin(ROUND), np.zeros(len(ROUND))])
    match body.shape:
        case Box(size=size):
            corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3), axis=-1).reshape(-1, 3)
            return np.asarray(corners * size)
        case Sphere(radius=radius):
            return np.asarray(radius * circle @ rotation)  # a ring that lies flat in the world
        case Capsule(radius=radius, length=length):
            rim = radius * circle @ rotation
            return np.vstack([rim + end for end in _ends(length)])
        case Cylinder(radius=radius, length=length):
            return np.vstack([radius * circle + end for end in _ends(length)])
        case ConvexHull(points=points):
            return points
        case HalfSpace():
            raise ValueError("a half-space has no outline")


def _ends(length: float) -> Floats:
    """(2, 3) m, ends of a segment along z."""
    return np.array([[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]])


def draw_floor(axes: Axes, cell: Cell) -> None:
    """The polygons in which bases may stand and must not stand."""
    floor = cell.surroundings.floor
    if floor is None:
        return
    if floor.allowed is not None:
        style: Any = {"fill": False, "ec": FLOOR, "lw": 0.9, "ls": (0, (8, 2, 2, 2)), "zorder": 0}
        axes.add_patch(Polygon(floor.allowed, label="allowed floor", **style))
    for index, corners in enumerate(floor.forbidden):
        label = "forbidden floor" if index == 0 else None
        style = {"fill": False, "ec": FLOOR, "lw": 0.6, "hatch": "////", "alpha": 0.45, "zorder": 0}
        axes.add_patch(Polygon(corners, label=label, **style))


def draw_obstacles(axes: Axes, cell: Cell) -> None:
    """Shadows of the obstacles with their names; walls as lines. Floors and ceilings are everywhere."""
    named = False
    for obstacle in cell.surroundings.obstacles:
        if isinstance(obstacle.shape, HalfSpace):
            _draw_wall(axes, obstacle)
            continue
        corners = outline(obstacle, np.eye(4))
        label = None if named else "obstacles"
        named = True
        axes.add_patch(Polygon(corners, fc=OBSTACLE, ec=OBSTACLE, alpha=0.35, lw=0.8, zorder=1, label=label))
        x, y = corners[np.argmin(corners.sum(axis=1))]  # the path of the part leads through the middle of many
        axes.text(x, y, obstacle.name, fontsize=6.5, color=FLOOR, ha="left", va="bottom", clip_on=True, zorder=2)


def _draw_wall(axes: Axes, obstacle: Body) -> None:
    """The line that a vertical half-space leaves of the floor."""
    normal = obstacle.pose[:3, 2]
    if abs(normal[2]) <= UPRIGHT:
        x, y = (float(value) for value in obstacle.pose[:2, 3])
        along = (x - float(normal[1]), y + float(normal[0]))
        axes.axline((x, y), along, color=OBSTACLE, lw=1.6, zorder=1, label=None)


def draw_bodies(axes: Axes, bodies: Iterable[Body], frame: Floats, colour: str, **style: Any) -> None:
    """Shadows of bodies that belong to a frame (4, 4)."""
    for body in bodies:
        axes.add_patch(Polygon(outline(body, frame), fc=colour, ec=colour, lw=0.8, **style))
