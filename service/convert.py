"""From a valid request to the objects of the lower floors; the last place where input is refused."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

from models.cell import Cell
from models.robot import Robot
from models.task import Task as ModelTask
from models.task import arc_about_normal, arc_through_center, line, task_from_poses
from optimizer.settings import CertificateSettings, Settings
from service.convert_arm import arm_of
from service.convert_pose import pose_of
from service.issues import Issues
from service.schemas.request import LayoutRequest
from service.schemas.task import ArcByCenter, ArcByRadius, LineTask, PosesTask, Task


def cell_of(request: LayoutRequest, robots: Mapping[str, Robot] | None = None) -> Cell:
    """The cell that a request describes.

    Args:
        request: a valid request.
        robots: further robots by name, looked up before the catalogue.

    Raises:
        InvalidRequest: with everything that is wrong with it.
    """
    issues = Issues()
    _check_baselines(request, issues)
    _check_names(request, issues)
    task = _task(request.task, issues)
    arms = [arm_of(arm, f"/arms/{index}", robots or {}, issues) for index, arm in enumerate(request.arms)]
    issues.raise_any()
    if task is None:
        raise AssertionError("a task that could not be made left no issue")
    return Cell(
        task=task,
        arms=tuple(arm for arm in arms if arm is not None),
        max_joint_step=min(request.max_joint_step, pi),
        name=request.name,
    )


def settings_of(request: LayoutRequest, time_limit: float) -> Settings:
    """What the optimizer is told about the way; ``time_limit`` [s] is the service's, not the user's."""
    certificate = request.certificate
    return Settings(
        time_limit=time_limit,
        certificate=None if certificate is None else CertificateSettings(certificate.gap, certificate.time_limit),
        baselines=tuple(request.baselines),
    )


def _check_baselines(request: LayoutRequest, issues: Issues) -> None:
    """Refuse repetitions."""
    for index, name in enumerate(request.baselines):
        if name in request.baselines[:index]:
            issues.add(f"/baselines/{index}", f"{name!r} is asked for twice; once is enough. Remove one.")


def _check_names(request: LayoutRequest, issues: Issues) -> None:
    """Refuse two arms of the same name."""
    names = [arm.name for arm in request.arms]
    for index, name in enumerate(names):
        if name in names[:index]:
            issues.add(
                f"/arms/{index}/name", f"Another arm is called {name!r} too; names must be unique. Rename one of them."
            )


def _task(task: Task, issues: Issues) -> ModelTask | None:
    """The poses of a task, or None if issues had to be noted."""
    before = len(issues.found)
    if isinstance(task, PosesTask):
        poses = [pose_of(pose, f"/task/poses/{index}", issues) for index, pose in enumerate(task.poses)]
        if len(issues.found) == before:
            with issues.at("/task"):
                return task_from_poses(poses)
        return None
    pointer, path = ("/task/line", task.line) if isinstance(task, LineTask) else ("/task/arc", task.arc)
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
