"""The task of a request: one way of the part, or a task sequence with grasps of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from duocell.models.cell.task import Task as ModelTask
from duocell.models.cell.task import arc_about_normal, arc_through_center, line, task_from_poses
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.models.robot.arm import Arm
from duocell.service.common.issues import IssueCollector, pointer_of, shortened
from duocell.service.requests.convert_pose import pose_of, poses_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.schemas.task import ArcByCenter, ArcByRadius, LineTask, PosesTask, Task


def task_of(request: LayoutRequest, issues: IssueCollector) -> ModelTask | None:
    """The poses of a request, or None if issues had to be noted."""
    if (request.task is None) == (request.tasks is None):
        given = "Both are given. Remove one" if request.task is not None else "'task' is missing. Add it"
        issues.add("/task", f"{given}: exactly one of task, tasks is needed.")
        return None
    if request.task is not None:
        return _path(request.task, "/task", issues)
    segments = []
    names = [segment.name for segment in request.tasks or []]
    taken: set[str] = set()
    for index, segment in enumerate(request.tasks or []):
        if segment.name in taken:
            issues.add(
                f"/tasks/{index}/name", f"Another job is called {segment.name!r} too; names must be unique. Rename one."
            )
        taken.add(segment.name)
        path = _path(segment.task, f"/tasks/{index}/task", issues)
        if path is not None:
            segments.append(TaskSegment(segment.name, path, segment.weight))
    return task_sequence(segments) if len(segments) == len(names) else None


def with_grasps(request: LayoutRequest, arms: Sequence[Arm | None], issues: IssueCollector) -> list[Arm]:
    """The arms with the grasps that the segments of a task sequence give them; those that could not be made are left
    out.
    """
    segments = request.tasks or []
    names = [arm.name for arm in request.arms]
    given = {}
    for index, segment in enumerate(segments):
        for name, pose in segment.grasps.items():
            pointer = pointer_of(["tasks", index, "grasps", name])
            if name not in names:
                issues.add(pointer, f"No arm is called {shortened(name)}; the arms are {', '.join(map(repr, names))}.")
            given[index, name] = pose_of(pose, pointer, issues)
    made = []
    for arm in arms:
        if arm is not None:
            own = [given.get((index, arm.name)) for index in range(len(segments))]
            grasps = np.array([arm.grasp if pose is None else pose for pose in own])
            made.append(arm if all(pose is None for pose in own) else replace(arm, grasps=grasps))
    return made


def _path(task: Task, pointer: str, issues: IssueCollector) -> ModelTask | None:
    """The poses of one way, or None if issues had to be noted."""
    before = len(issues.found)
    if isinstance(task, PosesTask):
        poses = poses_of(task.poses, f"{pointer}/poses", issues)
        if poses is not None:
            with issues.at(pointer):
                return task_from_poses(poses)
        return None
    pointer, path = (f"{pointer}/line", task.line) if isinstance(task, LineTask) else (f"{pointer}/arc", task.arc)
    start = pose_of(path.start, f"{pointer}/start", issues)
    end = pose_of(path.end, f"{pointer}/end", issues)
    if len(issues.found) > before:
        return None
    with issues.at(pointer):
        if isinstance(path, ArcByCenter):
            return arc_through_center(start, end, path.center, path.count)
        if isinstance(path, ArcByRadius):
            return arc_about_normal(start, end, path.radius, path.normal, path.count)
        return line(start, end, path.count)
    return None
