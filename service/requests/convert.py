"""From a valid request to the objects of the lower floors; the last place where input is refused."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, pi

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.objective.objective import JOINT_AVAILABILITY, Objective
from duocell.models.objective.registry import objective_from
from duocell.models.robot.arm import Arm
from duocell.optimizer.settings import CertificateSettings, Settings, ToleranceSettings
from duocell.service.common.issues import InvalidRequest, Issue, IssueCollector
from duocell.service.library.library import Library
from duocell.service.requests.convert_arm import arm_of
from duocell.service.requests.convert_coupling import couplings_of
from duocell.service.requests.convert_surroundings import surroundings_of
from duocell.service.requests.convert_task import task_of, with_grasps
from duocell.service.requests.convert_tolerance import with_tolerances
from duocell.service.requests.shared_joints import check_shared_joints
from duocell.service.schemas.evaluate import EvaluateRequest
from duocell.service.schemas.request import Certificate, LayoutRequest


def cell_of(request: LayoutRequest, library: Library | None = None, task: Task | None = None) -> Cell:
    """The cell that a request describes.

    Args:
        request: a valid request.
        library: what users brought; its robots are looked up before the catalogue.
        task: of the request, if that has been converted before.

    Raises:
        InvalidRequest: with everything that is wrong with it.
    """
    issues = IssueCollector()
    _check_baselines(request, issues)
    _check_names(request, issues)
    task = task_of(request, issues) if task is None else task
    robots = {} if library is None else library.robots()
    made = [arm_of(arm, f"/arms/{index}", robots, issues) for index, arm in enumerate(request.arms)]
    check_shared_joints(made, issues)
    arms = with_grasps(request, made, issues)
    if task is not None and len(arms) == len(request.arms):
        arms = with_tolerances(request, arms, task, issues)
    robots_made = [None if arm is None else arm.robot for arm in made]
    surroundings = surroundings_of(request, robots_made, library, issues)
    couplings = couplings_of(request.coupling, [arm.name for arm in request.arms], issues)
    _check_tolerance(request, issues)
    objective = _objective_of(request, arms, issues)
    issues.raise_any()
    if task is None or surroundings is None:
        raise AssertionError("a task or surroundings that could not be made left no issue")
    try:
        return Cell(
            task=task,
            arms=tuple(arms),
            max_joint_step=min(request.joint_steps.revolute, pi),
            max_prismatic_step=inf if request.joint_steps.prismatic is None else request.joint_steps.prismatic,
            name=request.name,
            surroundings=surroundings,
            couplings=couplings,
            objective=objective,
        )
    except InvalidInput as refused:
        raise InvalidRequest([Issue(refused.pointer, refused.detail)]) from refused


def joints_of(request: EvaluateRequest, cell: Cell) -> list[Floats | None]:
    """Joint values to be checked, per arm (m, n) rad or None.

    Args:
        request: a valid request.
        cell: that it describes.

    Raises:
        InvalidRequest: there is not one row per pose and one value per joint.
    """
    issues = IssueCollector()
    found: list[Floats | None] = []
    for index, (arm, made) in enumerate(zip(request.arms, cell.arms, strict=True)):
        pointer, rows = f"/arms/{index}/joints", arm.joints
        if rows is not None and made.freedom is not None:
            issues.add(
                pointer,
                "The arm has a tolerance, and joints are checked against poses that are given. Send null to have a "
                "path found, or leave the tolerance out.",
            )
        if rows is not None and len(rows) != len(cell.task):
            issues.add(
                pointer,
                f"{len(rows)} rows, but the task has {len(cell.task)} poses; one row per pose is needed. "
                "Send null to have a path found.",
            )
        for pose, row in enumerate(rows or []):
            if len(row) != made.dof:
                issues.add(
                    f"{pointer}/{pose}",
                    f"{len(row)} values, but {made.robot.name} has {made.dof} joints; one per joint is needed. "
                    f"The joints are {', '.join(made.robot.joint_names)}.",
                )
        found.append(None if rows is None or issues.found else np.array(rows))
    issues.raise_any()
    return found


def settings_of(request: LayoutRequest, time_limit: float) -> Settings:
    """What the optimizer is told about the way; ``time_limit`` [s] holds where the request has none."""
    tolerance, certificate = request.tolerance, request.certificate
    return Settings(
        time_limit=time_limit if request.time_limit is None else request.time_limit,
        certificate=CertificateSettings(certificate.gap, certificate.time_limit)
        if isinstance(certificate, Certificate)
        else certificate,
        baselines=tuple(request.baselines),
        alternatives=request.alternatives,
        tolerance=None if tolerance is None else ToleranceSettings(tolerance.position, tolerance.angle),
        explain=request.explain,
    )


def _objective_of(request: LayoutRequest, arms: Sequence[Arm], issues: IssueCollector) -> Objective:
    """What the layout is to be best at; the usual where what is asked for is none, or not for such arms."""
    try:
        objective = objective_from((term.measure, term.weight) for term in request.objective)
    except InvalidInput as error:
        issues.add(f"/objective{error.pointer}", error.detail)
        return JOINT_AVAILABILITY
    open_arms = [arm.name for arm in arms if arm.freedom is not None]
    if open_arms and objective.measures != JOINT_AVAILABILITY.measures:
        issues.add(
            "/objective",
            f"{objective.name} is asked for, but the poses of {', '.join(open_arms)} leave something open, and what is "
            f"open can only be chosen for {JOINT_AVAILABILITY.name} alone. Leave the objective out, or the tolerance "
            "of every arm.",
        )
    return objective


def _check_baselines(request: LayoutRequest, issues: IssueCollector) -> None:
    """Refuse repetitions."""
    for index, name in enumerate(request.baselines):
        if name in request.baselines[:index]:
            issues.add(f"/baselines/{index}", f"{name!r} is asked for twice; once is enough. Remove one.")


def _check_tolerance(request: LayoutRequest, issues: IssueCollector) -> None:
    """Refuse errors of nothing."""
    if request.tolerance is not None and request.tolerance.position == request.tolerance.angle == 0.0:
        issues.add(
            "/tolerance", "position and angle are both 0; at least one must be positive. Send null if it is not asked."
        )


def _check_names(request: LayoutRequest, issues: IssueCollector) -> None:
    """Refuse two arms of the same name."""
    names = [arm.name for arm in request.arms]
    for index, name in enumerate(names):
        if name in names[:index]:
            issues.add(
                f"/arms/{index}/name", f"Another arm is called {name!r} too; names must be unique. Rename one of them."
            )
