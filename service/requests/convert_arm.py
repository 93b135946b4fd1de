"""One arm of a request as an arm of the models: robot, limits, reference and weights that fit together."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.errors import UnknownRobot
from duocell.models.base.pose import rotation_from_rpy
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.dh import DhRow, robot_from_dh
from duocell.models.catalogue.reference import default_reference
from duocell.models.kinematics.nominal import posture_form
from duocell.models.robot.arm import NARROWEST, BaseRegion, Interval, equal_weights, range_weights
from duocell.models.robot.arm import Arm as ModelArm
from duocell.models.robot.joint import JointKind
from duocell.models.robot.linear_limits import LinearLimits
from duocell.models.robot.posture import ELBOW, SHOULDER, WRIST
from duocell.models.robot.posture import Posture as ModelPosture
from duocell.models.robot.robot import Robot
from duocell.service.common.issues import IssueCollector
from duocell.service.requests.convert_linear_limits import linear_limits_of
from duocell.service.requests.convert_pose import check_radians, pose_of
from duocell.service.schemas.arm import Arm, Base, DhTable, Posture
from duocell.service.validation.range_limits import as_list

SLACK = 1e-9
"""rad; a reference may differ from the limit it stands on in the last digit."""


def arm_of(arm: Arm, pointer: str, robots: Mapping[str, Robot], issues: IssueCollector) -> ModelArm | None:
    """The arm, or None if issues had to be noted.

    Args:
        arm: as requested.
        pointer: its place in the request.
        robots: robots of users by `Arm.robot_key`, looked up before the catalogue.
        issues: where to note what is wrong.
    """
    before = len(issues.found)
    in_flange = pose_of(arm.tool, f"{pointer}/tool", issues)
    grasp = pose_of(arm.grasp, f"{pointer}/grasp", issues)
    robot = _robot(arm, pointer, robots, issues)
    if robot is None:
        return None
    tool = flange_of(arm, robot, pointer, issues) @ in_flange
    check_radians([float(value) for value in as_list(arm.base.yaw)], f"{pointer}/base/yaw", issues)
    check_radians([arm.mount.roll], f"{pointer}/mount/roll", issues)
    check_radians([arm.mount.pitch], f"{pointer}/mount/pitch", issues)
    lower, upper = _limits(arm, robot, pointer, issues)
    reference = _reference(arm, robot, (lower, upper), pointer, issues)
    weights = _weights(arm, robot, (lower, upper), pointer, issues)
    posture = _posture(arm.posture, robot, pointer, issues)
    linear_limits = _linear_limits(arm, robot, (lower, upper), pointer, issues)
    if len(issues.found) > before:
        return None
    with issues.at(pointer):
        return ModelArm(
            name=arm.name,
            robot=robot,
            tool=tool,
            grasp=grasp,
            base=_region(arm.base),
            lower=lower,
            upper=upper,
            reference=reference,
            weights=weights,
            posture=posture,
            min_conditioning=arm.min_conditioning,
            mount=rotation_from_rpy([arm.mount.roll, arm.mount.pitch, 0.0]),
            avoid_singularities=arm.singularities == "avoid",
            linear_limits=linear_limits,
        )
    return None


def _robot(arm: Arm, pointer: str, robots: Mapping[str, Robot], issues: IssueCollector) -> Robot | None:
    """By name or from the table."""
    with issues.at(f"{pointer}/robot"):
        if not isinstance(arm.robot, DhTable):
            return _named(arm, arm.robot, f"{pointer}/robot_version", robots, issues)
        rows = [DhRow(r.alpha, r.a, r.d, r.lower, r.upper, r.theta_offset, JointKind(r.type)) for r in arm.robot.dh]
        return robot_from_dh("dh", rows, pose_of(arm.robot.first_frame, f"{pointer}/robot/first_frame", issues))
    return None


def _named(arm: Arm, name: str, pointer: str, robots: Mapping[str, Robot], issues: IssueCollector) -> Robot | None:
    """A robot of a user, or of the catalogue, which knows no versions; None if an issue had to be noted."""
    found = robots.get(arm.robot_key or name)
    if found is not None:
        return found
    if arm.robot_version is None:
        return catalogue.robot(name)
    there = "another version of it" if name in robots else "no robot of that name"
    issues.add(
        pointer,
        f"Version {arm.robot_version!r} of {name!r} is not there (any more); uploaded at present is {there}. "
        "Leave the version out to take the present one.",
        UnknownRobot.code,
    )
    return None


def flange_of(arm: Arm, robot: Robot, pointer: str, issues: IssueCollector) -> Floats:
    """(4, 4) m, the flange that is asked for, in the last frame of the robot's chain."""
    with issues.at(f"{pointer}/flange"):
        return robot.flange(arm.flange)
    return np.eye(4)


def _region(base: Base) -> BaseRegion:
    """Where the base may stand."""
    x, y, z, yaw = (Interval(min(pair), max(pair)) for pair in map(as_list, (base.x, base.y, base.z, base.yaw)))
    return BaseRegion(x, y, z, yaw)


def _fits(values: list[object], robot: Robot, pointer: str, issues: IssueCollector) -> bool:
    """Whether there is one value per joint."""
    if len(values) == robot.dof:
        return True
    issues.add(
        pointer,
        f"{len(values)} values, but {robot.name} has {robot.dof} joints; one per joint is needed. "
        f"The joints are {', '.join(robot.joint_names)}.",
    )
    return False


def _limits(arm: Arm, robot: Robot, pointer: str, issues: IssueCollector) -> tuple[Floats, Floats]:
    """(n,) lower and upper limits in force."""
    if arm.limits is None or not _fits([*arm.limits], robot, f"{pointer}/limits", issues):
        return robot.lower, robot.upper
    units = [kind.unit for kind in robot.joint_kinds]
    for joint, (low, high) in enumerate(arm.limits):
        if high - low < NARROWEST:
            issues.add(
                f"{pointer}/limits/{joint}",
                f"Joint {robot.joint_names[joint]} may not move at all ([{low:g}, {high:g}] {units[joint]}); "
                f"a lower limit {NARROWEST:g} {units[joint]} below the upper one is needed. Widen it.",
            )
    pairs = np.array(arm.limits)
    return pairs[:, 0], pairs[:, 1]


def _linear_limits(
    arm: Arm, robot: Robot, limits: tuple[Floats, Floats], pointer: str, issues: IssueCollector
) -> LinearLimits | None:
    """The limits between joints in force; None where there are none."""
    if arm.linear_limits is None:
        return robot.linear_limits
    return linear_limits_of(arm.linear_limits, robot, limits, f"{pointer}/linear_limits", issues)


def _reference(arm: Arm, robot: Robot, limits: tuple[Floats, Floats], pointer: str, issues: IssueCollector) -> Floats:
    """(n,) q*: the requested one, else the robot's where the limits in force admit it, else mid-range."""
    lower, upper = limits
    if arm.reference is None:
        return default_reference(robot, lower, upper)
    if not _fits([*arm.reference], robot, f"{pointer}/reference", issues):
        return robot.reference
    reference = np.array(arm.reference)
    units = [kind.unit for kind in robot.joint_kinds]
    outside: Bools = (reference < lower - SLACK) | (reference > upper + SLACK)
    for joint in np.flatnonzero(outside):
        issues.add(
            f"{pointer}/reference/{joint}",
            f"The reference {reference[joint]:.6g} {units[joint]} of joint {robot.joint_names[joint]} lies outside its "
            f"limits [{lower[joint]:.6g}, {upper[joint]:.6g}] {units[joint]}. Choose a value inside, or change the "
            "limits.",
        )
    return reference


def _weights(arm: Arm, robot: Robot, limits: tuple[Floats, Floats], pointer: str, issues: IssueCollector) -> Floats:
    """(n,) w of the objective."""
    if isinstance(arm.weights, list):
        return (
            np.array(arm.weights) if _fits([*arm.weights], robot, f"{pointer}/weights", issues) else np.ones(robot.dof)
        )
    return range_weights(*limits) if arm.weights == "range" else equal_weights(*limits)


def _posture(posture: Posture | None, robot: Robot, pointer: str, issues: IssueCollector) -> ModelPosture:
    """The signs that are asked for."""
    if posture is None:
        return ModelPosture()
    wanted = ModelPosture(
        shoulder=None if posture.shoulder is None else SHOULDER[posture.shoulder],
        elbow=None if posture.elbow is None else ELBOW[posture.elbow],
        wrist=None if posture.wrist is None else WRIST[posture.wrist],
    )
    if not wanted.free and posture_form(robot) is None:
        issues.add(
            f"{pointer}/posture",
            f"{robot.name} has no named postures: neither a spherical wrist nor three parallel axes. "
            "Send null; steer it with a reference.",
        )
    return wanted
