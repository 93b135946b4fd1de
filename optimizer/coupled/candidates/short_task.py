"""A long task stood for by some of its poses: layouts are looked for there, and all are carried over to the whole task.

The poses are spread over the way and the weight of every segment, and stand at its corners: between two of them the
object moves nearly straight, so that what is clean on the short task is clean, or nearly so, on the whole one. Whatever
is found is measured again on all poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.pose import rotation_angle
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.robot.arm import TURN
from duocell.optimizer.clearance.path_samples import ObjectPath
from duocell.optimizer.coupled.candidates.starts import Start
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.pose_sample import sample_segment
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed, reduced_problem
from duocell.optimizer.verification.scene import Scene

ASIDE, TURNED = 2e-3, 1e-2
"""m and rad; left out are poses that lie no farther from the straight way between their neighbours, if possible."""
CORNERS = 1.0
"""So many times the poses of a sample may be added at corners of the way."""


@dataclass(frozen=True, eq=False, slots=True)
class ShortTask:
    """A cell on some of its poses.

    Attributes:
        whole: scene of the cell. problems: its arms, on all poses. poses: (k,) numbers of those that are kept.
        scene: on these poses. short_problems: likewise.
    """

    whole: Scene
    problems: tuple[ReducedProblem, ...]
    poses: Ints
    scene: Scene
    short_problems: tuple[ReducedProblem, ...]

    @staticmethod
    def of(scene: Scene, problems: Sequence[ReducedProblem], count: int) -> ShortTask:
        """Keep about ``count`` poses of a cell; ``problems`` are those of its arms."""
        cell = scene.cell
        poses, task = shortened(cell.task, count)
        between = float(np.max(np.diff(poses), initial=1))
        turn, shift = min(pi, between * cell.max_joint_step), between * cell.max_prismatic_step
        short = replace(cell.with_task(task, poses), max_joint_step=turn, max_prismatic_step=shift)
        return ShortTask(scene, tuple(problems), poses, _on_task(scene, short), _problems(short, problems))

    def at_poses(self, points: Sequence[ArmSolution]) -> tuple[ArmSolution, ...]:
        """A layout of the whole task on the short one."""
        return tuple(replace(point, joints=point.joints[self.poses]) for point in points)

    def on_whole(self, points: Sequence[ArmSolution]) -> Start | None:
        """A layout of the short task on all poses and its violation there; None where an arm does not reach one."""
        found = []
        for problem, point in zip(self.problems, points, strict=True):
            whole = self._followed(problem, point)
            if whole is None:
                return None
            found.append(whole)
        violation = max(
            float(self.whole.contact_violations([found])[0]),
            self.whole.tie_violation(found),
            self.whole.floor_violation(found),
        )
        return Start(tuple(found), self.whole.objective(found), violation)

    def _followed(self, problem: ReducedProblem, point: ArmSolution) -> ArmSolution | None:
        """A point of one arm on all poses: the same base, posture and turns of the joints."""
        if point.signs is None:
            return None
        paths = evaluate_signed(problem, point.position[None], np.array([point.signs]))
        if paths.missing[0, 0] > 0.0:
            return None
        joints = paths.joints[:, 0, 0].T.copy()
        joints[:, 0] += problem.sigma * (float(paths.yaw[0, 0]) - point.yaw)
        for segment in problem.segments:
            first = int(np.searchsorted(self.poses, segment.start))
            joints[segment] += TURN * np.round((point.joints[first] - joints[self.poses[first]]) / TURN)
        return ArmSolution(point.position, point.yaw, joints, point.signs)


def shortened(task: Task, count: int) -> tuple[Ints, Task]:
    """About ``count`` poses of a task, and more at corners: their numbers (k,), and the task of them.

    What is left out counts for its neighbours, in proportion to how near they are on the way.
    """
    poses, weights, starts = [], np.zeros(len(task)), [0]
    for segment in task.segments:
        share = max(2, -(-count * (segment.stop - segment.start) // len(task)))
        frames = task.poses[segment]
        own, _ = sample_segment(frames[:, :3, :3], frames[:, :3, 3], task.weights[segment], share)
        own = _with_corners(frames, own)
        poses.append(segment.start + own)
        weights[segment] = _counted(_arc_length(frames), own, task.weights[segment])
        starts.append(starts[-1] + len(own))
    kept = np.concatenate(poses)
    return kept, Task(task.poses[kept], tuple(starts[:-1]), task.names, weights[kept])


def _with_corners(frames: Floats, chosen: Ints) -> Ints:
    """The chosen poses of a segment (m, 4, 4) and those that the way between them misses most."""
    if len(chosen) < 2:
        return chosen
    arc = _arc_length(frames)
    for _ in range(max(1, int(np.log2(len(frames))))):
        after = np.clip(np.searchsorted(chosen, np.arange(len(frames)), side="right"), 1, len(chosen) - 1)
        first, last = chosen[after - 1], chosen[after]
        length = arc[last] - arc[first]
        fraction = np.where(length > 0.0, (arc - arc[first]) / np.where(length > 0.0, length, 1.0), 0.0)
        straight = ObjectPath(frames[chosen]).at(after - 1, fraction)
        aside = np.linalg.norm(frames[:, :3, 3] - straight[:, :3, 3], axis=1) / ASIDE
        turned = rotation_angle(straight[:, :3, :3].swapaxes(1, 2) @ frames[:, :3, :3]) / TURNED
        missed = np.round(np.maximum(aside, turned), 6)
        farthest = np.zeros(len(chosen))
        np.maximum.at(farthest, after, missed)
        more = np.flatnonzero((missed > 1.0) & (missed == farthest[after]))
        more = more[np.unique(np.round(arc[more], 9), return_index=True)[1]]  # one of those where it rests
        if not len(more) or len(chosen) + len(more) > (1.0 + CORNERS) * max(len(chosen), 2):
            break
        chosen = np.union1d(chosen, more)
    return chosen


def _arc_length(frames: Floats) -> Floats:
    """(m,) rad + m from the first pose of a segment (m, 4, 4) to each."""
    moved = np.linalg.norm(np.diff(frames[:, :3, 3], axis=0), axis=1)
    turned = rotation_angle(frames[:-1, :3, :3].swapaxes(1, 2) @ frames[1:, :3, :3])
    return np.concatenate([[0.0], np.cumsum(moved + turned)])


def _counted(arc: Floats, chosen: Ints, weights: Floats) -> Floats:
    """(m,) what the chosen poses of a segment count for, 0 for the others: costs in between are interpolated."""
    if len(chosen) < 2:
        return weights
    after = np.clip(np.searchsorted(chosen, np.arange(len(arc)), side="right"), 1, len(chosen) - 1)
    first, last = chosen[after - 1], chosen[after]
    length = arc[last] - arc[first]
    share = np.where(length > 0.0, (arc - arc[first]) / np.where(length > 0.0, length, 1.0), 0.5)
    counted = np.zeros(len(arc))
    np.add.at(counted, first, (1.0 - share) * weights)
    np.add.at(counted, last, share * weights)
    return counted


def _on_task(scene: Scene, cell: Cell) -> Scene:
    """The scene with other poses."""
    return replace(scene, cell=cell, path=ObjectPath(cell.task.poses))


def _problems(cell: Cell, problems: Sequence[ReducedProblem]) -> tuple[ReducedProblem, ...]:
    """The arms on the poses of a cell, in the same postures."""
    found = []
    for arm, problem in zip(cell.arms, problems, strict=True):
        own = reduced_problem(cell, arm)
        if own is None:
            raise AssertionError("an arm lost its reduced problem")
        found.append(replace(own, postures=problem.postures))
    return tuple(found)
