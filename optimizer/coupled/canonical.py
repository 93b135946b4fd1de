"""One form of a cell whatever the order in which its arms, its obstacles and its poses are given.

A search has to prefer one of several things that are equally good, and one order in which to try them. Done in this
form, that does not depend on how somebody happened to write the cell down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Surroundings
from duocell.models.cell.task import Task
from duocell.optimizer.nlp.program import ArmSolution

TOLD_APART = 1e-6
"""m, and of rotation matrices; motions that differ by less are the same."""


@dataclass(frozen=True, eq=False, slots=True)
class CanonicalForm:
    """A cell in the form in which it is searched.

    Attributes:
        cell: in that form. order: the number that each of its arms has in the cell as it was given.
        backwards: True if its poses are those that were given from the last to the first.
    """

    cell: Cell
    order: tuple[int, ...]
    backwards: bool

    @staticmethod
    def of(cell: Cell) -> CanonicalForm:
        """Arms and obstacles by name; the poses in the direction that a comparison of both ways decides."""
        order = tuple(sorted(range(len(cell.arms)), key=lambda arm: cell.arms[arm].name))
        place = {arm: number for number, arm in enumerate(order)}
        ties = tuple(replace(tie, arms=tuple(place[arm] for arm in tie.arms)) for tie in cell.couplings)
        arms, around = tuple(cell.arms[arm] for arm in order), _sorted(cell.surroundings)
        form = replace(cell, arms=arms, surroundings=around, couplings=ties)
        backwards = _is_backwards(cell.task)
        return CanonicalForm(_reversed(form) if backwards else form, order, backwards)

    @property
    def is_as_given(self) -> bool:
        """True if neither arms nor poses changed places."""
        return not self.backwards and self.order == tuple(range(len(self.order)))

    def into(self, points: Sequence[ArmSolution]) -> tuple[ArmSolution, ...]:
        """A layout of the cell as it was given, one point per arm, as one of this form."""
        return tuple(self._turned(points[arm]) for arm in self.order)

    def back(self, points: Sequence[ArmSolution]) -> tuple[ArmSolution, ...]:
        """A layout of this form as one of the cell as it was given."""
        given = dict(zip(self.order, points, strict=True))
        return tuple(self._turned(given[arm]) for arm in range(len(points)))

    def _turned(self, point: ArmSolution) -> ArmSolution:
        return replace(point, joints=point.joints[::-1]) if self.backwards else point


def _sorted(around: Surroundings) -> Surroundings:
    """Obstacles by name, forbidden parts of the floor by their corners."""
    floor = around.floor
    if floor is not None:
        floor = replace(floor, forbidden=tuple(sorted(floor.forbidden, key=lambda polygon: polygon.tolist())))
    return replace(around, obstacles=tuple(sorted(around.obstacles, key=lambda body: body.name)), floor=floor)


def _reversed(cell: Cell) -> Cell:
    """Poses, and so segments, from the last to the first."""
    task = cell.task
    starts = tuple(len(task) - segment.stop for segment in reversed(task.segments))
    back = Task(task.poses[::-1], starts, task.names[::-1], task.weights[::-1])
    arms = tuple(arm if arm.grasps is None else replace(arm, grasps=arm.grasps[::-1]) for arm in cell.arms)
    return replace(cell, arms=arms).with_task(back, np.arange(len(task))[::-1])


def _is_backwards(task: Task) -> bool:
    """True if a task is the one of the two directions that is not searched.

    Compared are weights and motions from pose to pose, as the object sees them: they are what no place of the task in
    the world changes. Of a task that is the same both ways, either will do.
    """
    there = _signature(task.poses, task.weights)
    back = _signature(task.poses[::-1], task.weights[::-1])
    apart = (there - back).ravel()
    first = np.flatnonzero(np.abs(apart) > TOLD_APART)
    return bool(len(first)) and bool(apart[first[0]] < 0.0)


def _signature(poses: Floats, weights: Floats) -> Floats:
    """(m - 1, 13) weight of a pose and the motion to the next one in the frame of the object."""
    motions = inverse(poses[:-1]) @ poses[1:]
    return np.hstack([weights[:-1, None], motions[:, :3, 3], motions[:, :3, :3].reshape(-1, 9)])
