"""Tolerances of poses as freedoms of the models; what contradicts itself or leaves nothing open is refused here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi, tau

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.task import Task
from duocell.models.robot.arm import Arm
from duocell.models.robot.freedom import LENGTHS, SIZE, TILT, Frame, Freedom
from duocell.service.common.issues import IssueCollector
from duocell.service.requests.convert_pose import check_radians
from duocell.service.schemas.request import LayoutRequest
from duocell.service.schemas.task import PoseTolerance

FRAMES = {"tool": Frame.TOOL, "part": Frame.PART, "world": Frame.WORLD}
WIDEST_CONE = 3.1
"""rad; at π the tilt has no shortest way, so a wider cone is kept to this."""
STEEPEST = pi / 2 - 1e-6
"""rad; a turn about y beyond leads to orientations that other turns lead to as well."""
PARALLEL = 1e-6
"""Of unit vectors that are one axis."""
Range = tuple[float, float]
TURNS = SIZE - 3
"""The first parameter that is a turn."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A tolerance, its place in the request, and the poses that it holds for: from ``first`` to ``last``."""

    tolerance: PoseTolerance
    pointer: str
    first: int
    last: int


def with_tolerances(request: LayoutRequest, arms: Sequence[Arm], task: Task, issues: IssueCollector) -> list[Arm]:
    """The arms with what their poses leave open; those of a request with issues may be left as they are.

    Args:
        request: valid. arms: all of its arms, in order. task: all of its poses.
        issues: where to note what is wrong.
    """
    made = []
    for index, (given, arm) in enumerate(zip(request.arms, arms, strict=True)):
        before = len(issues.found)
        placed = [*_of_arm(given.tolerance, f"/arms/{index}/tolerance", task, issues)]
        freedom = _freedom(placed, len(task), issues) if placed and len(issues.found) == before else None
        made.append(arm if freedom is None else replace(arm, freedom=freedom))
    return made


def _of_arm(
    given: PoseTolerance | list[PoseTolerance] | None, pointer: str, task: Task, issues: IssueCollector
) -> list[Placed]:
    """The tolerances of an arm, with the poses that they hold for."""
    several = given if isinstance(given, list) else [] if given is None else [given]
    placed: list[Placed] = []
    for number, one in enumerate(several):
        at = f"{pointer}/{number}" if isinstance(given, list) else pointer
        first, last = one.poses or (0, len(task) - 1)
        if first > last or last >= len(task):
            issues.add(
                f"{at}/poses",
                f"[{first}, {last}] are no poses of the task, which has {len(task)}, counted from 0. "
                "Send the first and the last one, in this order.",
            )
            continue
        for other in placed:
            if first <= other.last and other.first <= last:
                issues.add(
                    f"{at}/poses" if one.poses else at,
                    f"Pose {max(first, other.first)} has another tolerance already, at {other.pointer}. Give each pose "
                    "one, by ranges of poses that do not overlap.",
                )
        placed.append(Placed(one, at, first, last))
    return placed


def _freedom(placed: Sequence[Placed], count: int, issues: IssueCollector) -> Freedom | None:
    """What is open at all poses; None where nothing is, or where issues had to be noted."""
    lower, upper, cone = np.zeros((count, SIZE)), np.zeros((count, SIZE)), np.zeros(count)
    axes, frames = np.tile(np.eye(3), (count, 1, 1)), np.zeros(count, dtype=np.int64)
    steps = np.full(SIZE, np.inf)
    before = len(issues.found)
    for one in placed:
        rows = slice(one.first, one.last + 1)
        ranges, half, turned = _ranges(one, issues)
        for index, (low, high) in ranges.items():
            lower[rows, index], upper[rows, index] = low, high
        cone[rows], axes[rows], frames[rows] = half, turned, FRAMES[one.tolerance.frame]
        steps = np.minimum(steps, _steps(one, issues))
    if len(issues.found) > before:
        return None
    freedom = Freedom(lower, upper, cone, axes, frames, steps)
    return freedom if np.any(freedom.open) or np.any(lower != 0.0) else None


def _ranges(one: Placed, issues: IssueCollector) -> tuple[dict[int, Range], float, Floats]:
    """Ranges of the parameters, half the opening of the cone [rad], and the axes (3, 3)."""
    given, at = one.tolerance, one.pointer
    if given.position is None and given.rotation is None and given.cone is None and given.roll is None:
        issues.add(at, "None of position, rotation, cone and roll is given, so nothing is open. Add one, or send null.")
    if given.rotation is not None and (given.cone is not None or given.roll is not None):
        other = "cone" if given.cone is not None else "roll"
        issues.add(
            f"{at}/{other}",
            f"rotation is given too, and both say how the tool may be turned. Leave {other} or rotation out.",
        )
    ranges: dict[int, Range] = {}
    for index, name in enumerate("xyz"):
        found = None if given.position is None else getattr(given.position, name)
        if found is not None:
            ranges[index] = found[0], found[1]
    if given.rotation is not None:
        ranges |= _rotation(given, f"{at}/rotation", issues)
        return ranges, 0.0, np.eye(3)
    axis = _axis(given, at, issues)
    half = 0.0
    if given.cone is not None:
        check_radians([given.cone.angle], f"{at}/cone/angle", issues)
        half = min(given.cone.angle, WIDEST_CONE)
        ranges |= dict.fromkeys(range(SIZE)[TILT], (-half, half))
    if given.roll is not None:
        ranges[SIZE - 1] = _turn(given.roll.range, f"{at}/roll/range", issues)
    return ranges, half, _axes_about(axis)


def _rotation(given: PoseTolerance, at: str, issues: IssueCollector) -> dict[int, Range]:
    """Ranges of the turns about x, y and z."""
    ranges: dict[int, Range] = {}
    for index, name in enumerate("xyz"):
        found = getattr(given.rotation, name)
        if found is None:
            continue
        low, high = _turn(found, f"{at}/{name}", issues)
        if name == "y" and max(abs(low), abs(high)) > STEEPEST:
            issues.add(
                f"{at}/y",
                f"[{low:g}, {high:g}] rad goes beyond ±π/2, where turns about x and z lead to the same orientations. "
                "Keep it within, or use a cone and a roll.",
            )
        ranges[TURNS + index] = low, high
    return ranges


def _turn(found: str | list[float], at: str, issues: IssueCollector) -> Range:
    """A range of turns; one of a whole turn is free."""
    if isinstance(found, str):
        return -np.inf, np.inf
    check_radians(found, at, issues)
    return (-np.inf, np.inf) if found[1] - found[0] >= tau else (found[0], found[1])


def _axis(given: PoseTolerance, at: str, issues: IssueCollector) -> Floats:
    """(3,) unit vector, the axis of cone and roll."""
    found = []
    for name, part in (("cone", given.cone), ("roll", given.roll)):
        if part is None:
            continue
        axis = np.array(part.axis)
        size = float(np.linalg.norm(axis))
        if size < 1e-9:
            issues.add(f"{at}/{name}/axis", "The axis is zero; give a direction, such as [0, 0, 1].")
            axis, size = np.array([0.0, 0.0, 1.0]), 1.0
        found.append(axis / size)
    if len(found) == 2 and float(np.linalg.norm(found[0] - found[1])) > PARALLEL:
        issues.add(
            f"{at}/roll/axis",
            "cone and roll have different axes, but the roll is the turn about the axis that the cone tilts. "
            "Give both the same axis, or use rotation.",
        )
    return found[0] if found else np.array([0.0, 0.0, 1.0])


def _axes_about(axis: Floats) -> Floats:
    """(3, 3) columns x, y, z with z along a unit vector; the identity where that is z already."""
    if np.array_equal(axis, [0.0, 0.0, 1.0]):
        return np.eye(3)
    aside = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(aside, axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _steps(one: Placed, issues: IssueCollector) -> Floats:
    """(8,) m and rad that the parameters may change by from pose to pose."""
    steps, most = np.full(SIZE, np.inf), one.tolerance.max_step
    if most is not None and one.tolerance.same_for_all:
        issues.add(
            f"{one.pointer}/max_step",
            "same_for_all asks for one displacement at all poses, so there are no steps to limit. Leave one out.",
        )
    if one.tolerance.same_for_all:
        if one.tolerance.poses is not None:
            issues.add(
                f"{one.pointer}/poses",
                "same_for_all asks for one displacement at all poses, not at some of them. Leave poses out.",
            )
        return np.zeros(SIZE)
    if most is not None:
        steps[:LENGTHS] = np.inf if most.position is None else most.position
        steps[LENGTHS:] = np.inf if most.rotation is None else most.rotation
        if most.rotation is not None:
            check_radians([most.rotation], f"{one.pointer}/max_step/rotation", issues)
    return steps
