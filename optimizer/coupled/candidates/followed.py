"""A cell whose arms are followed between its poses: places on the way count for nothing in the cost but are held.

What goes wrong on the straight way between two poses (reach, limits, posture, contacts) makes a layout unusable as
well, and is seen here for thousands of placements at once. Tasks whose poses lie close to each other are taken as they
are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.path_samples import ObjectPath
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import Paths, ReducedProblem, evaluate, evaluate_signed, reduced_problem
from duocell.optimizer.verification.scene import Scene

LONGEST_TURN, LONGEST_SHIFT = 0.3, 0.12
"""rad and m of the object between places that are looked at."""
FEW, MOST_CUTS, MOST_PLACES = 8, 5, 90
"""Steps of tasks with so few poses are always cut; into so many intervals at most; tasks that would get more places
than that are not cut."""


@dataclass(frozen=True, eq=False, slots=True)
class FollowedProblem:
    """The reduced problem of one arm at all places.

    Attributes:
        problem: at all places; those between the poses weigh nothing. poses: (m,) numbers of the poses among them.
        most: rad, allowed joint step from pose to pose. joined: (m - 1,) True within a segment.
    """

    problem: ReducedProblem
    poses: Ints
    most: float
    joined: Ints

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.problem.arm

    def at(self, positions: Floats, signs: Ints | None = None) -> tuple[Paths, Floats]:
        """Best paths of every posture, or of one per position, from base positions (N, 3); see
        `duocell.optimizer.reduction.reduced`.

        Returns:
            Paths at all places; and (8, N) or (1, N), how far from allowed they are.
        """
        paths = evaluate(self.problem, positions) if signs is None else evaluate_signed(self.problem, positions, signs)
        if len(self.poses) == paths.joints.shape[-1]:
            return paths, paths.violation
        steps = np.abs(np.diff(paths.joints[..., self.poses], axis=-1))[..., self.joined]
        most = np.max(steps, axis=(0, -1), initial=0.0)
        return paths, paths.violation + np.maximum(most - self.most, 0.0)


@dataclass(frozen=True, eq=False, slots=True)
class Followed:
    """A cell at and between its poses.

    Attributes:
        scene: of the cell with all places for poses. problems: of its arms. poses: (m,) numbers of the poses.
    """

    scene: Scene
    problems: tuple[FollowedProblem, ...]
    poses: Ints

    @staticmethod
    def of(scene: Scene, problems: Sequence[ReducedProblem]) -> Followed:
        """Cut the way between the poses of a cell.

        Args:
            scene: of the cell. problems: reduced problem of each arm; their postures are kept.
        """
        cell, poses = _cut(scene.cell)
        same = len(poses) == len(cell.task)
        found = []
        for arm, problem in zip(cell.arms, problems, strict=True):
            dense = problem if same else reduced_problem(cell, arm)
            if dense is None:
                raise AssertionError("an arm lost its reduced problem")
            dense = replace(dense, postures=problem.postures)
            joined = np.flatnonzero(scene.cell.task.joined)
            found.append(FollowedProblem(dense, poses, scene.cell.max_joint_step, joined))
        return Followed(scene if same else Scene.of(cell), tuple(found), poses)

    def at_poses(self, points: Sequence[ArmSolution]) -> tuple[ArmSolution, ...]:
        """A layout at the poses alone."""
        return tuple(replace(point, joints=point.joints[self.poses]) for point in points)


def _cut(cell: Cell) -> tuple[Cell, Ints]:
    """The cell with places between its poses, and the numbers of the poses among them."""
    task, path = cell.task, ObjectPath(cell.task.poses)
    m, joined = len(task), np.flatnonzero(task.joined)
    shifted, turned = np.linalg.norm(path.shifts, axis=1), np.linalg.norm(path.turns, axis=1)
    wanted = np.ceil(np.maximum(turned / LONGEST_TURN, shifted / LONGEST_SHIFT) - 1e-9)
    if m <= FEW:
        wanted = np.where(np.maximum(turned, shifted) > 1e-9, np.maximum(wanted, 2.0), 1.0)
    cuts = np.ones(m - 1, dtype=np.int64)
    cuts[joined] = np.clip(wanted[joined], 1, MOST_CUTS)
    if np.sum(cuts) + 1 > MOST_PLACES or np.all(cuts == 1):
        return cell, np.arange(m)
    step = np.append(np.repeat(np.arange(m - 1), cuts), m - 1)
    fraction = np.append(np.concatenate([np.arange(c) / c for c in cuts]), 0.0)
    poses, between = np.flatnonzero(fraction == 0.0), np.flatnonzero(fraction > 0.0)
    objects, weights = np.empty((len(step), 4, 4)), np.zeros(len(step))
    objects[poses], weights[poses] = task.poses, task.weights
    objects[between] = path.at(step[between], fraction[between])
    starts = tuple(int(poses[start]) for start in task.starts)
    cut = replace(task, poses=objects, weights=weights, starts=starts)
    return cell.with_places(cut, poses, step[between], fraction[between]), poses
