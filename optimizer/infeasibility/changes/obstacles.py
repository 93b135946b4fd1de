"""An obstacle moved out of the way: in the direction in which least of it is enough for a layout that is known."""

from __future__ import annotations

from dataclasses import replace
from math import atan2

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.geometry.shapes import Body
from duocell.optimizer.infeasibility.changes.remedy import FARTHEST, Remedy
from duocell.optimizer.infeasibility.requirements import Requirement
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.scene import LIMITS, Scene

DIRECTIONS = 8
"""Level directions; up and down besides."""
NEAREST, GROWTH = 0.01, 1.6
"""m, the first distance that is tried for all directions; and the factor to the next."""


def moved_obstacle(cell: Cell, requirement: Requirement) -> Remedy:
    """The obstacle gone for good; `Remedy.fitted` moves it no farther than a layout needs."""
    k = requirement.index
    obstacles = cell.surroundings.obstacles

    def gone(amount: float) -> Cell:
        del amount
        return replace(cell, surroundings=replace(cell.surroundings, obstacles=(*obstacles[:k], *obstacles[k + 1 :])))

    def words(amount: float) -> str:
        del amount
        return f"remove {obstacles[k].name}"

    def fitted(points: tuple[ArmSolution, ...]) -> Remedy:
        return min(
            (_towards(cell, requirement, d) for d in _directions(cell, k)),
            key=lambda r: _enough(r, points),
        )

    return Remedy(gone, words, _pointer(k), 1.0, 1.0, 1.0, requirement, fitted=fitted)


def _pointer(k: int) -> str:
    return f"/obstacles/{k}/pose/position"


def _towards(cell: Cell, requirement: Requirement, direction: Floats) -> Remedy:
    """The obstacle moved along a direction (3,)."""
    k, obstacles = requirement.index, cell.surroundings.obstacles
    obstacle = obstacles[k]

    def change(amount: float) -> Cell:
        moved = Body(obstacle.name, transform(np.eye(3), amount * direction) @ obstacle.pose, obstacle.shape)
        changed = (*obstacles[:k], moved, *obstacles[k + 1 :])
        return replace(cell, surroundings=replace(cell.surroundings, obstacles=changed))

    def words(amount: float) -> str:
        components, place = direction + 0.0, obstacle.pose[:3, 3] + amount * direction
        towards, there = (", ".join(f"{c:.{n}f}" for c in at) for at, n in ((components, 2), (place, 4)))
        return f"move {obstacle.name} by {1e3 * amount:.0f} mm towards ({towards}), to ({there})"

    return Remedy(change, words, _pointer(k), 0.02, FARTHEST, 1e-3, requirement)


def _directions(cell: Cell, k: int) -> list[Floats]:
    """Directions: away from the task and along the obstacle's own axes first."""
    obstacle = cell.surroundings.obstacles[k]
    off = obstacle.pose[:3, 3] - np.mean(cell.task.poses[:, :3, 3], axis=0)
    own = obstacle.pose[:2, 0] if np.hypot(*obstacle.pose[:2, 0]) > 1e-6 else np.array([1.0, 0.0])
    start = atan2(float(own[1]), float(own[0]))
    level = [
        np.array([np.cos(start + t), np.sin(start + t), 0.0]) for t in 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    ]
    away = float(np.hypot(off[0], off[1]))
    first = [np.array([off[0] / away, off[1] / away, 0.0])] if away > 1e-9 else []
    return [
        np.round(direction, 6) for direction in (*first, *level, np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]))
    ]


def _enough(remedy: Remedy, points: tuple[ArmSolution, ...]) -> float:
    """m, about the smallest distance for which a layout keeps everything at the poses; inf where none is."""
    amount = NEAREST
    while amount <= FARTHEST:
        if Scene.of(remedy.change(amount)).contact_violations([points])[0] <= LIMITS:
            return amount
        amount *= GROWTH
    return np.inf
