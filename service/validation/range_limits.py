"""Sizes: how much a request may ask for. The amounts are settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import radians, tau

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.service.common.issues import InvalidRequest, Issue, pointer_of
from duocell.service.schemas.arm import Arm, DhTable
from duocell.service.schemas.evaluate import PlacedArm
from duocell.service.schemas.request import Certificate, LayoutRequest
from duocell.service.schemas.task import ArcByCenter, ArcByRadius, ArcTask, LineTask, PosesTask, Task
from duocell.service.settings import Limits
from duocell.service.validation.count_limits import CODE

MOST_KEPT = 5.0
"""m; nobody asks for a larger clearance, margin or grasp zone: it is in millimetres."""
MOST_NORMAL = 1e6
"""Of the numbers of a normal; the square of what is far larger is infinite."""


def check_sizes(request: LayoutRequest, limits: Limits) -> None:
    """Refuse coordinates, angles and times that no workcell has.

    Raises:
        InvalidRequest: with one issue per number.
    """
    found = [*_far(request, limits), *_wide(request, limits), *_thick(request), *_steep(request)]
    found += _long(request, limits)
    if found:
        raise InvalidRequest(found)


def _long(request: LayoutRequest, limits: Limits) -> Iterator[Issue]:
    """Times beyond the limit; the default of the service is always allowed."""
    longest = max(limits.max_time_limit, limits.time_limit)
    if request.time_limit is not None and request.time_limit > longest:
        detail = (
            f"{request.time_limit:g} s are too long; allowed are {longest:g} s (DUOCELL_MAX_TIME_LIMIT). Ask for less "
            "time, or leave it out."
        )
        yield Issue("/time_limit", detail, CODE)
    certificate = request.certificate
    if isinstance(certificate, Certificate) and certificate.time_limit > limits.max_certificate_time:
        detail = (
            f"{certificate.time_limit:g} s are too long; allowed are {limits.max_certificate_time:g} s "
            "(DUOCELL_MAX_CERTIFICATE_TIME). Ask for less time or a larger gap."
        )
        yield Issue("/certificate/time_limit", detail, CODE)


def _far(request: LayoutRequest, limits: Limits) -> Iterator[Issue]:
    """Coordinates beyond the limit."""
    for pointer, values in lengths_of(request, limits.max_coordinate):
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
    for pointer, values in angles_of(request):
        for index, value in enumerate(values):
            if abs(value) > limits.max_angle:
                yield Issue(
                    pointer if len(values) == 1 else f"{pointer}/{index}",
                    f"{value:g} rad are {abs(value) / tau:.3g} turns; allowed is {limits.max_angle:g} rad either way "
                    f"(DUOCELL_MAX_ANGLE). Angles are radians: {value:g}° would be {radians(value):.6g}.",
                    CODE,
                )


def _thick(request: LayoutRequest) -> Iterator[Issue]:
    """Distances to keep that are plainly millimetres."""
    kept = [] if request.clearance is None else request.clearance.model_dump().items()
    asked = [(f"/clearance/{name}", value) for name, value in kept if value is not None]
    asked += [] if request.floor is None else [("/floor/margin", request.floor.margin)]
    asked += [] if request.part is None else [("/part/grasp_zone", request.part.grasp_zone)]
    for pointer, value in asked:
        if value > MOST_KEPT:
            detail = (
                f"{value:g} m is more than any cell keeps; at most {MOST_KEPT:g} m. Lengths are metres: if millimetres "
                f"were meant, send {value / 1e3:g}."
            )
            yield Issue(pointer, detail)


def _steep(request: LayoutRequest) -> Iterator[Issue]:
    """Normals whose length leaves the numbers."""
    for pointer, task in _ways(request):
        if (
            isinstance(task, ArcTask)
            and isinstance(task.arc, ArcByRadius)
            and max(map(abs, task.arc.normal)) > MOST_NORMAL
        ):
            detail = f"Its numbers must not exceed {MOST_NORMAL:g}; only its direction counts. Send a unit vector."
            yield Issue(f"{pointer}/arc/normal", detail)


def _ways(request: LayoutRequest) -> Iterator[tuple[str, Task]]:
    """Every task, with its place."""
    if request.task is not None:
        yield "/task", request.task
    for index, segment in enumerate(request.tasks or []):
        yield f"/tasks/{index}/task", segment.task


def lengths_of(request: LayoutRequest, beyond: float) -> Iterator[tuple[str, list[float]]]:
    """Lengths of a request that are greater than ``beyond`` m, with their place; with those that belong to them."""
    for pointer, task in _ways(request):
        if isinstance(task, PosesTask):
            yield from _far_positions(f"{pointer}/poses", task.poses.positions, beyond)
    for pointer, values in _lengths(request):
        if max(map(abs, values)) > beyond:
            yield pointer, values


def _far_positions(at: str, positions: Floats, beyond: float) -> Iterator[tuple[str, list[float]]]:
    """Positions (m, 3) with a coordinate beyond a number."""
    for index in np.flatnonzero(np.abs(positions).max(axis=1) > beyond).tolist():
        yield f"{at}/{index}/position", positions[index].tolist()


def _lengths(request: LayoutRequest) -> Iterator[tuple[str, list[float]]]:
    """Every length but those of lists of poses."""
    for pointer, task in _ways(request):
        if not isinstance(task, PosesTask):
            yield from _lengths_of_path(pointer, task)
    for index, segment in enumerate(request.tasks or []):
        for name, pose in segment.grasps.items():
            yield pointer_of(["tasks", index, "grasps", name, "position"]), pose.position
    for index, arm in enumerate(request.arms):
        at = f"/arms/{index}"
        yield f"{at}/tool/position", arm.tool.position
        yield f"{at}/grasp/position", arm.grasp.position
        for name in ("x", "y", "z"):
            yield f"{at}/base/{name}", as_list(getattr(arm.base, name))
        yield from _lengths_of_tolerances(at, arm)
        if arm.pedestal is not None and arm.pedestal.foot is not None:
            yield f"{at}/pedestal/foot", [arm.pedestal.foot]
    yield from _lengths_of_floor_and_couplings(request)


def _lengths_of_tolerances(at: str, arm: Arm) -> Iterator[tuple[str, list[float]]]:
    """Boxes for the position."""
    given = arm.tolerance
    for number, one in enumerate(given if isinstance(given, list) else [] if given is None else [given]):
        where = f"{at}/tolerance/{number}" if isinstance(given, list) else f"{at}/tolerance"
        for name in ("x", "y", "z"):
            found = None if one.position is None else getattr(one.position, name)
            if found is not None:
                yield f"{where}/position/{name}", found


def _lengths_of_path(at: str, task: LineTask | ArcTask) -> Iterator[tuple[str, list[float]]]:
    """Both ends, and what defines an arc."""
    at, path = (f"{at}/arc", task.arc) if isinstance(task, ArcTask) else (f"{at}/line", task.line)
    yield f"{at}/start/position", path.start.position
    yield f"{at}/end/position", path.end.position
    if isinstance(path, ArcByCenter):
        yield f"{at}/center", path.center
    elif isinstance(path, ArcByRadius):
        yield f"{at}/radius", [path.radius]


def _lengths_of_floor_and_couplings(request: LayoutRequest) -> Iterator[tuple[str, list[float]]]:
    """Corners and points; shapes and their places are judged by the models."""
    if request.floor is not None:
        yield "/floor/margin", [request.floor.margin]
        for corner, point in enumerate(request.floor.allowed or []):
            yield f"/floor/allowed/{corner}", point
        for index, polygon in enumerate(request.floor.forbidden):
            for corner, point in enumerate(polygon):
                yield f"/floor/forbidden/{index}/{corner}", point
    for index, coupling in enumerate(request.coupling):
        yield from ((f"/coupling/{index}/{field}", values) for field, values in coupling.lengths())


def angles_of(request: LayoutRequest, slides: Sequence[bool] = ()) -> Iterator[tuple[str, list[float]]]:
    """Every angle whose size costs work, with its place.

    Args:
        request: a valid request.
        slides: for each arm, whether its first joint is a linear axis, whose values are no angles; where that is not
            known yet they are counted among them.
    """
    for index, arm in enumerate(request.arms):
        at = f"/arms/{index}"
        yield f"{at}/base/yaw", as_list(arm.base.yaw)
        yield f"{at}/mount/roll", [arm.mount.roll]
        yield f"{at}/mount/pitch", [arm.mount.pitch]
        yield from _joint_angles(at, arm, int(bool(slides) and slides[index]))
    for index, coupling in enumerate(request.coupling):
        yield from ((f"/coupling/{index}/{field}", values) for field, values in coupling.angles())


def _joint_angles(at: str, arm: Arm, first: int) -> Iterator[tuple[str, list[float]]]:
    """Of the joints from the ``first`` on."""
    for joint, pair in list(enumerate(arm.limits or []))[first:]:
        yield f"{at}/limits/{joint}", pair
    for index, limit in enumerate(arm.linear_limits or []):
        yield f"{at}/linear_limits/{index}/lower", [limit.lower]
        yield f"{at}/linear_limits/{index}/upper", [limit.upper]
    if arm.reference is not None:
        yield f"{at}/reference", arm.reference[first:]
    if isinstance(arm, PlacedArm):
        yield from ((f"{at}/joints/{pose}", values[first:]) for pose, values in enumerate(arm.joints or []))
    if isinstance(arm.robot, DhTable):
        for joint, row in enumerate(arm.robot.dh):
            if row.type == "prismatic":
                continue
            yield f"{at}/robot/dh/{joint}/lower", [row.lower]
            yield f"{at}/robot/dh/{joint}/upper", [row.upper]


def as_list(value: float | list[float]) -> list[float]:
    """A number as a list of one."""
    return value if isinstance(value, list) else [value]
