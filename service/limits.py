"""Sizes: how much a request may ask for. The amounts are settings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from service.issues import InvalidRequest, Issue, Issues, pointer_of
from service.schemas.arm import Arm, DhTable
from service.schemas.request import LayoutRequest
from service.schemas.task import ArcByCenter, ArcByRadius, ArcTask, LineTask, PosesTask
from service.settings import Limits

CODE = "too-large"


def check_amounts(document: Any, limits: Limits) -> None:
    """Refuse too many poses or arms before each of them is looked at.

    Raises:
        InvalidRequest: more than the settings allow.
    """
    issues = Issues()
    task = _member(document, "task")
    for path, amount in (
        (("task", "poses"), _length(_member(task, "poses"))),
        (("task", "line", "count"), _count(_member(task, "line"))),
        (("task", "arc", "count"), _count(_member(task, "arc"))),
    ):
        if amount > limits.max_poses:
            issues.add(
                pointer_of(path),
                f"{amount} poses are too many; allowed are {limits.max_poses} (DUOCELL_MAX_POSES). "
                "Send fewer: every second pose usually gives the same layout.",
                CODE,
            )
    arms = _length(_member(document, "arms"))
    if arms > limits.max_arms:
        issues.add(
            "/arms",
            f"{arms} arms are too many; allowed are {limits.max_arms} (DUOCELL_MAX_ARMS). "
            "Uncoupled arms may as well be sent one by one.",
            CODE,
        )
    issues.raise_any()


def check_sizes(request: LayoutRequest, limits: Limits) -> None:
    """Refuse coordinates, angles and times that no workcell has.

    Raises:
        InvalidRequest: with one issue per number.
    """
    found = [*_far(request, limits), *_wide(request, limits)]
    if request.certificate is not None and request.certificate.time_limit > limits.max_certificate_time:
        found.append(
            Issue(
                "/certificate/time_limit",
                f"{request.certificate.time_limit:g} s are too long; allowed are {limits.max_certificate_time:g} s "
                "(DUOCELL_MAX_CERTIFICATE_TIME). Ask for less time or a larger gap.",
                CODE,
            )
        )
    if found:
        raise InvalidRequest(found)


def _member(value: Any, name: str) -> Any:
    return value.get(name) if isinstance(value, dict) else None


def _length(value: Any) -> int:
    return len(value) if isinstance(value, list) else 0


def _count(generator: Any) -> int:
    count = _member(generator, "count")
    return count if isinstance(count, int) else 0


def _far(request: LayoutRequest, limits: Limits) -> Iterator[Issue]:
    """Coordinates beyond the limit."""
    for pointer, values in _lengths(request):
        for index, value in enumerate(values):
            if abs(value) > limits.max_coordinate:
                yield Issue(
                    pointer if len(values) == 1 else f"{pointer}/{index}",
                    f"{value:g} m is beyond any workcell; allowed is {limits.max_coordinate:g} m either way "
                    "(DUOCELL_MAX_COORDINATE). Lengths are metres; move the origin nearer to the cell.",
                    CODE,
                )


def _wide(request: LayoutRequest, limits: Limits) -> Iterator[Issue]:
    """Angles beyond the limit."""
    for pointer, values in _angles(request):
        for index, value in enumerate(values):
            if abs(value) > limits.max_angle:
                yield Issue(
                    pointer if len(values) == 1 else f"{pointer}/{index}",
                    f"{value:g} rad is more than any joint turns; allowed is {limits.max_angle:g} rad either way "
                    "(DUOCELL_MAX_ANGLE). Angles are radians, not degrees.",
                    CODE,
                )


def _lengths(request: LayoutRequest) -> Iterator[tuple[str, list[float]]]:
    """Every length of a request, with its place."""
    task = request.task
    if isinstance(task, PosesTask):
        for index, pose in enumerate(task.poses):
            yield f"/task/poses/{index}/position", pose.position
    else:
        name = "line" if isinstance(task, LineTask) else "arc"
        path = task.arc if isinstance(task, ArcTask) else task.line
        yield f"/task/{name}/start/position", path.start.position
        yield f"/task/{name}/end/position", path.end.position
        if isinstance(path, ArcByCenter):
            yield "/task/arc/center", path.center
        elif isinstance(path, ArcByRadius):
            yield "/task/arc/radius", [path.radius]
    for index, arm in enumerate(request.arms):
        at = f"/arms/{index}"
        yield f"{at}/tool/position", arm.tool.position
        yield f"{at}/grasp/position", arm.grasp.position
        for name in ("x", "y", "z"):
            yield f"{at}/base/{name}", as_list(getattr(arm.base, name))


def _angles(request: LayoutRequest) -> Iterator[tuple[str, list[float]]]:
    """Every angle whose size costs work, with its place."""
    for index, arm in enumerate(request.arms):
        at = f"/arms/{index}"
        yield f"{at}/base/yaw", as_list(arm.base.yaw)
        yield from _joint_angles(at, arm)


def _joint_angles(at: str, arm: Arm) -> Iterator[tuple[str, list[float]]]:
    for joint, pair in enumerate(arm.limits or []):
        yield f"{at}/limits/{joint}", pair
    if arm.reference is not None:
        yield f"{at}/reference", arm.reference
    if isinstance(arm.robot, DhTable):
        for joint, row in enumerate(arm.robot.dh):
            yield f"{at}/robot/dh/{joint}/lower", [row.lower]
            yield f"{at}/robot/dh/{joint}/upper", [row.upper]


def as_list(value: float | list[float]) -> list[float]:
    """A number as a list of one."""
    return value if isinstance(value, list) else [value]
