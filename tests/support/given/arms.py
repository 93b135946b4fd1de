"""Arms for tests: short to write, with the defaults a request would get."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.dh import DhRow, robot_from_dh
from duocell.models.catalogue.reference import mid_range
from duocell.models.kinematics.closed_form import ClosedForm, closed_form
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.robot import Robot
from tests.support.given.fields import ArmFields

Side = ArrayLike | Interval
"""A number where there is nothing to choose, or both ends."""


def region(x: Side = (-1.0, 1.0), y: Side = (-1.0, 1.0), z: Side = 0.0, yaw: Side = FREE_YAW) -> BaseRegion:
    """A base region from numbers (fixed), pairs or intervals."""
    return BaseRegion(_interval(x), _interval(y), _interval(z), _interval(yaw))


def only_at(position: Floats, yaw: float) -> BaseRegion:
    """The region of a base that may stand in one place only."""
    x, y, z = (float(value) for value in position)
    return region(x, y, z, float(yaw))


def _interval(value: Side) -> Interval:
    if isinstance(value, Interval):
        return value
    low, high = np.broadcast_to(np.asarray(value, dtype=float), 2)
    return Interval(float(low), float(high))


def make_arm(
    robot: str | Robot = "puma560", name: str = "arm", base: BaseRegion | None = None, **given: Unpack[ArmFields]
) -> Arm:
    """An arm of a cell; ``given`` are fields of `Arm`, the rest as a request leaves them."""
    robot = catalogue.robot(robot) if isinstance(robot, str) else robot
    lower, upper = given.get("lower", robot.lower), given.get("upper", robot.upper)
    inside = (robot.reference >= lower) & (robot.reference <= upper)
    plain = Arm(
        name,
        robot,
        tool=np.eye(4),
        grasp=np.eye(4),
        base=base or region(),
        lower=lower,
        upper=upper,
        reference=np.where(inside, robot.reference, mid_range(lower, upper)),
        weights=range_weights(lower, upper),
    )
    return replace(plain, **given)


def form_of(robot: Robot) -> ClosedForm:
    """The closed form of a robot that has one."""
    form = closed_form(robot)
    assert form is not None, robot.name
    return form


def random_joints(arm: Robot | Arm, count: int, rng: np.random.Generator, margin: float = 0.0) -> Floats:
    """(count, n) rad inside the limits, ``margin`` rad away from them; endless joints within a turn."""
    low = np.where(np.isfinite(arm.lower), arm.lower + margin, -pi)
    high = np.where(np.isfinite(arm.upper), arm.upper - margin, pi)
    return rng.uniform(low, high, (count, arm.dof))


def puma_by_table() -> Robot:
    """The source's PUMA as a user would send it: a D-H table."""
    degrees, metres = np.radians, 1e-3
    table = (
        (-90, 0.0, 0.0, -160, 160),
        (0, 431.8, 149.1, -185, 45),
        (90, -20.3, 0.0, -45, 225),
        (-90, 0.0, 433.1, -110, 170),
        (90, 0.0, 0.0, -100, 100),
        (0, 0.0, 56.3, -266, 266),
    )
    rows = [DhRow(degrees(al), a * metres, d * metres, degrees(low), degrees(high)) for al, a, d, low, high in table]
    return robot_from_dh("table", rows)


def oblique_wrist() -> Robot:
    """A six-joint arm with a spherical wrist whose axes are 60° apart, as on painting robots: not every orientation
    of the flange can be reached wherever its wrist is.
    """
    rows = [
        DhRow(-pi / 2, 0.1, 0.4, -3.0, 3.0),
        DhRow(0.0, 0.6, 0.0, -3.0, 3.0),
        DhRow(pi / 2, 0.05, 0.0, -3.0, 3.0),
        DhRow(-pi / 3, 0.0, 0.6, -3.0, 3.0),
        DhRow(pi / 3, 0.0, 0.0, -3.0, 3.0),
        DhRow(0.0, 0.0, 0.1, -3.0, 3.0),
    ]
    return robot_from_dh("oblique", rows)


def general_six() -> Robot:
    """A six-joint arm of no closed-form class."""
    rows = [
        DhRow(-pi / 2, 0.1, 0.35, -2.9, 2.9),
        DhRow(0.1, 0.5, 0.05, -2.5, 2.5),
        DhRow(pi / 2, 0.05, 0.0, -2.5, 2.5),
        DhRow(-pi / 2, 0.04, 0.5, -2.9, 2.9),
        DhRow(pi / 2, 0.03, 0.0, -2.0, 2.0),
        DhRow(0.0, 0.0, 0.1, -2.9, 2.9),
    ]
    return robot_from_dh("general", rows)


def skew_rows(angle: float) -> list[DhRow]:
    """A spherical-wrist arm whose axes 1 and 2 are not at right angles."""
    return [
        DhRow(angle, 0.15, 0.4, -3.0, 3.0),
        DhRow(0.0, 0.5, 0.12, -3.0, 3.0),
        DhRow(pi / 2, 0.05, 0.1, -3.0, 3.0),
        DhRow(-pi / 2, 0.0, 0.55, -3.0, 3.0),
        DhRow(pi / 2, 0.0, 0.0, -3.0, 3.0),
        DhRow(0.0, 0.0, 0.1, -3.0, 3.0),
    ]


def skew_robot() -> Robot:
    """`skew_rows` at 60°."""
    return robot_from_dh("skew", skew_rows(1.05))
