"""Poses and arms from the numbers that people have, with the defaults of a request."""

from __future__ import annotations

from math import pi
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput, InvalidRotation, UnknownRobot
from duocell.models.base.pose import (
    rotation_from_matrix,
    rotation_from_quaternion,
    rotation_from_rpy,
    transform,
)
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.reference import default_reference
from duocell.models.robot.arm import NARROWEST, Arm, BaseRegion, Interval, equal_weights, range_weights
from duocell.models.robot.robot import Robot

Range = float | tuple[float, float]
"""A number that is fixed, or the lowest and the highest that are allowed."""
SLACK = 1e-9
"""rad; a reference may differ from the limit it stands on in the last digit."""


def pose(
    position: ArrayLike = (0.0, 0.0, 0.0),
    *,
    rpy: ArrayLike | None = None,
    quaternion: ArrayLike | None = None,
    matrix: ArrayLike | None = None,
) -> Floats:
    """A frame in another one.

    Args:
        position: (3,) m, of its origin.
        rpy: (3,) rad, roll, pitch and yaw: turned about the fixed x, then y, then z axis.
        quaternion: (4,) x, y, z, w, of length 1 within 1e-3.
        matrix: (3, 3) rotation.

    At most one of the three orientations is given; none: not turned.

    Returns:
        (4, 4) transform.

    Raises:
        InvalidInput: the position is not three finite numbers, or more than one orientation is given.
        InvalidRotation: the orientation is no rotation.
    """
    point = np.asarray(position, dtype=np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InvalidInput("a position is three finite numbers, in m.", "/position")
    if sum(one is not None for one in (rpy, quaternion, matrix)) > 1:
        raise InvalidInput("more than one orientation is given; give one of rpy, quaternion and matrix.")
    rotation: Floats = np.eye(3)
    if rpy is not None:
        rotation = rotation_from_rpy(rpy)
    elif quaternion is not None:
        rotation = rotation_from_quaternion(quaternion)
    elif matrix is not None:
        rotation = rotation_from_matrix(matrix)
    return transform(rotation, point)


def make_arm(
    name: str,
    robot: str | Robot,
    *,
    x: Range,
    y: Range,
    z: Range = 0.0,
    yaw: Range = (-pi, pi),
    grasp: ArrayLike,
    tool: ArrayLike | None = None,
    flange: str | None = None,
    limits: ArrayLike | None = None,
    reference: ArrayLike | None = None,
    weights: Literal["equal", "range"] | ArrayLike = "range",
    min_conditioning: float | None = None,
) -> Arm:
    """An arm of a cell. What is left out is what it is in a request.

    Rarer fields (`Arm.mount`, `Arm.posture`, `Arm.linear_limits`, ...) are changed with `dataclasses.replace`.

    Args:
        name: unique in its cell.
        robot: a name of the catalogue (``duocell robots`` lists them), or a robot.
        x, y, z: m, where the origin of the base may stand in the world.
        yaw: rad, of the base about the vertical; free if it is left out.
        grasp: (4, 4) tool centre point (TCP) in the frame of the part.
        tool: (4, 4) TCP in the flange frame, whose z axis points out of the flange; None: the flange itself.
        flange: which of the robot's flanges (`Robot.flange_names`) holds the tool; None: the usual one.
        limits: (n, 2) rad, lowest and highest value of every joint; None: the robot's own.
        reference: (n,) rad, joint values to be near to; None: the robot's own, or the middle of the limits.
        weights: what joints count for in the objective: "range" (the wider, the less), "equal", or (n,) numbers >= 0.
        min_conditioning: smallest allowed σmin/σmax of the Jacobian along the path; None: any.

    Raises:
        InvalidInput: a value that cannot be used, with a pointer to it (``/reference``, ``/grasp``, ...);
            `UnknownRobot` and `InvalidRotation` are among them.
    """
    body = _robot(robot)
    lower, upper = _limits(body, limits)
    wanted = default_reference(body, lower, upper) if reference is None else _values(body, reference, "/reference")
    if np.any((wanted < lower - SLACK) | (wanted > upper + SLACK)):
        raise InvalidInput("the reference lies outside the limits of its joints.", "/reference")
    if min_conditioning is not None and not 0.0 <= min_conditioning <= 1.0:
        raise InvalidInput(f"min_conditioning is {min_conditioning:g}; it is between 0 and 1.", "/min_conditioning")
    region = BaseRegion(_interval(x, "/x"), _interval(y, "/y"), _interval(z, "/z"), _interval(yaw, "/yaw"))
    in_flange = np.eye(4) if tool is None else _rigid(tool, "/tool")
    return Arm(
        name=name,
        robot=body,
        tool=_flange(body, flange) @ in_flange,
        grasp=_rigid(grasp, "/grasp"),
        base=region,
        lower=lower,
        upper=upper,
        reference=wanted,
        weights=_weights(body, weights, lower, upper),
        min_conditioning=min_conditioning,
        linear_limits=body.linear_limits,
    )


def _robot(robot: str | Robot) -> Robot:
    if isinstance(robot, Robot):
        return robot
    try:
        return catalogue.robot(robot)
    except UnknownRobot as error:
        raise UnknownRobot(error.detail, "/robot") from error


def _flange(robot: Robot, name: str | None) -> Floats:
    try:
        return robot.flange(name)
    except InvalidInput as error:
        raise InvalidInput(error.detail, "/flange") from error


def _values(robot: Robot, values: ArrayLike, pointer: str) -> Floats:
    """(n,) finite numbers, one per joint."""
    found = np.asarray(values, dtype=np.float64)
    if found.shape != (robot.dof,) or not np.isfinite(found).all():
        raise InvalidInput(f"{robot.name} has {robot.dof} joints; one finite number per joint is needed.", pointer)
    return found


def _limits(robot: Robot, limits: ArrayLike | None) -> tuple[Floats, Floats]:
    """(n,) rad, lower and upper limits in force."""
    if limits is None:
        return robot.lower, robot.upper
    pairs = np.asarray(limits, dtype=np.float64)
    if pairs.shape != (robot.dof, 2) or not np.all(pairs[:, 1] - pairs[:, 0] >= NARROWEST):
        raise InvalidInput(
            f"{robot.name} has {robot.dof} joints; for each of them a lower and a higher limit are needed, at least "
            f"{NARROWEST:g} rad apart.",
            "/limits",
        )
    return pairs[:, 0], pairs[:, 1]


def _weights(robot: Robot, weights: str | ArrayLike, lower: Floats, upper: Floats) -> Floats:
    """(n,) w of the objective."""
    if isinstance(weights, str):
        if weights not in ("equal", "range"):
            raise InvalidInput(f'weights are "equal", "range" or numbers, not {weights[:40]!r}.', "/weights")
        return equal_weights(lower, upper) if weights == "equal" else range_weights(lower, upper)
    return _values(robot, weights, "/weights")


def _interval(value: Range, pointer: str) -> Interval:
    ends = np.asarray(value, dtype=np.float64)
    if ends.ndim == 0:
        ends = np.array([ends, ends])
    if ends.shape != (2,) or not np.isfinite(ends).all() or ends[0] > ends[1]:
        raise InvalidInput("a number, or the lowest and the highest that are allowed, in this order.", pointer)
    return Interval(float(ends[0]), float(ends[1]))


def _rigid(values: ArrayLike, pointer: str) -> Floats:
    """(4, 4) transform, checked."""
    found = np.asarray(values, dtype=np.float64)
    if found.shape != (4, 4) or not np.array_equal(found[3], (0.0, 0.0, 0.0, 1.0)):
        raise InvalidInput("a 4x4 transform is needed; `duocell.pose` makes one.", pointer)
    try:
        return pose(found[:3, 3], matrix=found[:3, :3])
    except InvalidRotation as error:
        raise InvalidRotation(error.detail, pointer) from error
    except InvalidInput as error:
        raise InvalidInput(error.detail, pointer) from error
