"""More poses where joints turn too far from one to the next: as many as the steps of a known layout need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.optimizer.clearance.path_samples import ObjectPath, flanges_at, follow
from duocell.optimizer.infeasibility.searched.trial import clean
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.findings import Relaxation
from duocell.optimizer.verification.scene import Scene

ROUNDS = 4
"""Times that poses are added where steps between them are still too long."""
MOST = 200
"""Poses that are added at most."""


def more_poses(cell: Cell, points: Sequence[ArmSolution]) -> Relaxation | None:
    """Poses to be added with which a layout keeps the largest joint step; None where that takes too many.

    Args:
        cell: the cell. points: a layout that breaks nothing but ``cell.max_joint_step``, one point per arm.
    """
    joints = [point.joints for point in points]
    cuts = np.ones(len(cell.task) - 1, dtype=np.int64)
    for _ in range(ROUNDS):
        cuts = cuts * _too_long(cell, joints, cuts)
        if np.sum(cuts - 1) > MOST:
            return None
        changed = _with_poses(cell, cuts)
        joints = [_followed(cell, a, point, cuts) for a, point in enumerate(points)]
        if any(not np.all(np.isfinite(q)) for q in joints):
            return None
        layout = [replace(point, joints=q) for point, q in zip(points, joints, strict=True)]
        scene = Scene.of(changed)
        if clean(scene, layout):
            return Relaxation(_words(cuts), "/task/poses", scene.objective(layout))
    return None


def _too_long(cell: Cell, joints: Sequence[Floats], cuts: Ints) -> Ints:
    """(m - 1,) into how many parts every step from pose to pose still has to be cut."""
    steps = np.repeat(np.arange(len(cuts)), cuts)
    shares = [np.abs(np.diff(q, axis=0)) / cell.step_limits(a.robot) for q, a in zip(joints, cell.arms, strict=True)]
    widest = np.max([np.max(share, axis=1) for share in shares], axis=0)
    factor: Ints = np.ones(len(cuts), dtype=np.int64)
    parts = np.ceil(widest - 1e-9).astype(np.int64)
    np.maximum.at(factor, steps, np.maximum(parts, 1))
    return np.where(cell.task.joined, factor, 1)


def _with_poses(cell: Cell, cuts: Ints) -> Cell:
    """The cell with every step of its task cut into so many equal parts."""
    step, fraction = _places(cuts)
    poses = np.concatenate([ObjectPath(cell.task.poses).at(step, fraction), cell.task.poses[-1:]])
    first = np.concatenate([[0], np.cumsum(cuts)])
    starts = tuple(int(first[start]) for start in cell.task.starts)
    weights = np.append(np.where(fraction == 0.0, cell.task.weights[step], 1.0), cell.task.weights[-1])
    return replace(cell, task=Task(poses, starts, cell.task.names, weights))


def _places(cuts: Ints) -> tuple[Ints, Floats]:
    """Pose before, and fraction of the way to the next, of all poses but the last."""
    step = np.repeat(np.arange(len(cuts)), cuts)
    return step, np.concatenate([np.arange(cut) / cut for cut in cuts])


def _followed(cell: Cell, a: int, point: ArmSolution, cuts: Ints) -> Floats:
    """(k, n) rad, joints of an arm at the poses and those between; NaN where it does not get to."""
    arm, (step, fraction) = cell.arms[a], _places(cuts)
    base = arm.base_in_world(point.position, point.yaw)
    objects = ObjectPath(cell.task.poses).at(step, fraction)
    flanges = flanges_at(cell, arm, objects, step, fraction, point.free)
    found, good = follow(arm.robot, base, flanges, point.joints[step], point.joints[step + 1])
    found[~good] = np.nan
    found[fraction == 0.0] = point.joints[step[fraction == 0.0]]
    return np.concatenate([found, point.joints[-1:]])


def _words(cuts: Ints) -> str:
    """In words, "add 2 poses between 5 and 6, and 1 between 7 and 8"."""
    parts: list[str] = []
    for step in np.flatnonzero(cuts > 1):
        count = int(cuts[step] - 1)
        poses = f" pose{'s' if count > 1 else ''}" if not parts else ""
        parts.append(f"{count}{poses} between {step} and {step + 1}")
    return f"add {', '.join(parts[:-1])}{' and ' if len(parts) > 1 else ''}{parts[-1]}, evenly along the way"
