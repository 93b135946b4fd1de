"""Poses at which the part is held still: many of a task, but one place to be reached.

Where the part rests, a few poses at either end of the rest leave a redundant arm the time to turn into
another posture, and one pose that has the weight of all others stands for these. An arm without redundancy cannot
move while the part rests, so one pose stands for all. Searched is the small task; what is found there is the start of a
local solve on the whole one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.pose import rotation_angle
from duocell.models.cell.cell import Cell
from duocell.models.cell.pose_freedom import EQUATIONS
from duocell.models.cell.task import Task
from duocell.optimizer.nlp.program import ArmSolution

MOVED, TURNED = 5e-4, 1e-3
"""m and rad between neighbouring poses of a part that is held."""
ASIDE, TILTED = 1e-2, 5e-2
"""m and rad that a held pose may be away from the one that stands for it."""
LEAST_TURNING, MOST_TURNING = 3, 12
"""Poses at either end of a rest that stay; as many as half a turn takes."""
WORTHWHILE = 4
"""Poses that one stands for at least."""


@dataclass(frozen=True, eq=False, slots=True)
class HeldTask:
    """A cell in which one pose stands for many.

    Attributes:
        cell: with the small task. rows: (m,) which of its poses stands for each of the whole task.
    """

    cell: Cell
    rows: Ints

    def on_whole(self, point: ArmSolution) -> ArmSolution:
        """A point of the small task on all poses."""
        return replace(point, joints=point.joints[self.rows])


def with_held_poses(cell: Cell, dof: int) -> HeldTask | None:
    """The task of a cell for an arm of so many joints, with one pose where many hold the part; None if none do."""
    task = cell.task
    turning = 0
    if dof > EQUATIONS:
        turning = int(np.clip(np.ceil(np.pi / cell.max_joint_step), LEAST_TURNING, MOST_TURNING))
    new = np.ones(len(task), dtype=np.bool_)
    for first, last in _rests(task):
        inner = slice(first + turning, last + 1 - turning)
        if inner.stop - inner.start >= WORTHWHILE and _near(task.poses[inner]):
            new[inner.start + 1 : inner.stop] = False
    if np.all(new):
        return None
    rows = np.cumsum(new) - 1
    ends = np.append(np.flatnonzero(new), len(task))
    kept = (ends[:-1] + ends[1:] - 1) // 2
    starts = tuple(int(rows[start]) for start in task.starts)
    small = Task(task.poses[kept], starts, task.names, np.bincount(rows, task.weights).astype(np.float64))
    return HeldTask(cell.with_task(small, kept), rows)


def _rests(task: Task) -> list[tuple[int, int]]:
    """First and last pose of every longest stretch in which the part hardly moves from pose to pose."""
    still = _still(task.poses) & task.joined
    edges = np.diff(np.concatenate([[False], still, [False]]).astype(np.int64))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def _still(poses: Floats) -> Bools:
    """(m - 1,) True where the next pose is nearly the same."""
    moved = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    turned = rotation_angle(np.swapaxes(poses[:-1, :3, :3], 1, 2) @ poses[1:, :3, :3])
    still: Bools = (moved < MOVED) & (turned < TURNED)
    return still


def _near(poses: Floats) -> bool:
    """True if all poses are near the middle one: a part that moves slowly is not held."""
    middle = poses[(len(poses) - 1) // 2]
    aside = np.linalg.norm(poses[:, :3, 3] - middle[:3, 3], axis=1)
    turned = rotation_angle(middle[:3, :3].T @ poses[:, :3, :3])
    return bool(np.all(aside < ASIDE) and np.all(turned < TILTED))
