"""Places on the path at which distances are kept while a layout is being refined: the poses, and some between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.optimizer.clearance.path_samples import ObjectPath, flanges_at
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.on_task import REACHED, brought_onto

LONGEST_STEP, LONGEST_SHIFT = 0.25, 0.08
"""rad of any joint and m of the object between neighbouring samples."""
MOST = 12
"""Intervals that a step between two poses is cut into at most; what dips in between is found by the final check."""


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """Configurations along the path of one layout.

    Attributes:
        step: (K,) index of the pose before. fraction: (K,) of the way to the next, 1 only at the last pose.
        joints: per arm (K, n) rad. objects: (K, 4, 4) object frames in the world. segments: (K,) numbers of their
            segments.
        followed: False if an arm cannot follow the object somewhere between two poses; such places are left out.
    """

    step: Ints
    fraction: Floats
    joints: tuple[Floats, ...]
    objects: Floats
    segments: Ints
    followed: bool

    @property
    def poses(self) -> Ints:
        """(m,) numbers of the samples at the poses."""
        return np.flatnonzero((self.fraction == 0.0) | (self.fraction == 1.0))


def sample_path(
    cell: Cell,
    path: ObjectPath,
    bases: Floats,
    points: Sequence[ArmSolution],
    between: Sequence[tuple[int, float]] = (),
) -> Samples:
    """Sample a layout's path.

    Args:
        cell: task and arms. path: of its object. bases: (A, 4, 4) in the world. points: one per arm.
        between: further places, (pose, fraction of the way to the next).
    """
    m = len(cell.task)
    cuts = np.where(cell.task.joined, _cuts(path, points), 1)  # from one segment to the next there is no way
    step = np.concatenate([np.repeat(np.arange(m - 1), cuts), [m - 2]])
    fraction = np.concatenate([np.concatenate([np.arange(c) / c for c in cuts]), [1.0]])
    for before, part in between:
        at = int(np.searchsorted(step + fraction, before + part))
        step, fraction = np.insert(step, at, before), np.insert(fraction, at, part)
    at_pose = (fraction == 0.0) | (fraction == 1.0)
    pose = step + (fraction == 1.0)
    inner = np.flatnonzero(~at_pose)
    objects = np.empty((len(step), 4, 4))
    objects[at_pose] = cell.task.poses[pose[at_pose]]
    objects[inner] = path.at(step[inner], fraction[inner])
    good = np.ones(len(step), dtype=np.bool_)
    joints = []
    for arm, base, point in zip(cell.arms, bases, points, strict=True):
        q = np.empty((len(step), arm.dof))
        q[at_pose] = point.joints[pose[at_pose]]
        if len(inner):
            flanges = flanges_at(cell, arm, objects[inner], step[inner], fraction[inner], point.free)
            before, after = point.joints[step[inner]], point.joints[step[inner] + 1]
            share = fraction[inner, None]
            near = (1.0 - share) * before + share * after
            q[inner], missing = brought_onto(arm, point.signs, base, flanges, near, near)
            good[inner] &= missing < REACHED
        joints.append(q)
    segments = cell.task.segment_of[pose]
    return Samples(
        step[good], fraction[good], tuple(q[good] for q in joints), objects[good], segments[good], bool(np.all(good))
    )


def _cuts(path: ObjectPath, points: Sequence[ArmSolution]) -> Ints:
    """(m - 1,) into how many intervals each step is cut."""
    turned = np.max([np.max(np.abs(np.diff(point.joints, axis=0)), axis=1) for point in points], axis=0)
    shifted = np.linalg.norm(path.shifts, axis=1)
    cuts = np.ceil(np.maximum(turned / LONGEST_STEP, shifted / LONGEST_SHIFT) - 1e-9)
    limited: Ints = np.clip(cuts, 1, MOST).astype(np.int64)
    return limited
