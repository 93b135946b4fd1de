"""Check an answer with numbers that did not produce it: Pinocchio's kinematics of every pose, limits, continuity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.base.pose import rotation_angle
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import path_signs, posture_terms
from duocell.models.kinematics.closed_form import ClosedForm, closed_form
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses
from duocell.models.kinematics.nominal import posture_form
from duocell.models.kinematics.wrist_singularity import wrist_shortfall
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import Signs
from duocell.optimizer.nlp.measure import largest_step, largest_steps
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.layout import Verification
from duocell.optimizer.verification.tolerances import tolerance_excess

POSITION = 1e-6
"""m"""
ORIENTATION = 1e-6
"""rad"""
LIMITS = KEPT
"""rad, m; also the slack of joint steps and of the conditioning."""
SIDE = 1e-7
"""How far across a singular set (m, or sine of an angle) a path may seem to be through rounding alone."""


@dataclass(frozen=True, slots=True)
class ArmCheck:
    """Independent figures of one arm at a point; see `duocell.optimizer.results.layout.Verification`.

    Attributes:
        position_error: m. orientation_error: rad. joint_step: rad, of revolute joints within a segment.
        limits: largest excess over joint limits, linear ones among them, and base region, rad or m, <= 0 if none.
        posture: largest distance on the wrong side of a singular set, <= 0 if none.
        conditioning: by how much σmin/σmax falls short of what the request asks for, <= 0 if it does not.
        singularity: rad by which the wrist is nearer to its singularity than the arm may be, 0 if it is not.
        max_joint_step: rad, allowed.
        prismatic_step: m, of prismatic joints within a segment; None without any. max_prismatic_step: m, allowed.
        tolerance: m or rad by which a pose lies outside of what is open there, or changes too much; <= 0 if none does.
    """

    position_error: float
    orientation_error: float
    joint_step: float
    limits: float
    posture: float
    conditioning: float
    singularity: float
    max_joint_step: float
    prismatic_step: float | None = None
    max_prismatic_step: float = np.inf
    tolerance: float = 0.0

    @property
    def usable(self) -> bool:
        """True if the point may be given to a user."""
        return (
            self.position_error <= POSITION
            and self.orientation_error <= ORIENTATION
            and self.joint_step <= self.max_joint_step + LIMITS
            and (self.prismatic_step or 0.0) <= self.max_prismatic_step + LIMITS
            and self.limits <= LIMITS
            and self.posture <= SIDE
            and self.conditioning <= LIMITS
            and self.singularity <= 0.0
            and self.tolerance <= LIMITS
        )


def check(cell: Cell, arm: Arm, point: ArmSolution) -> ArmCheck:
    """Check one arm's part of an answer.

    Args:
        cell: the task.
        arm: the arm.
        point: base placement, joints and posture.
    """
    base_in_world = arm.base_in_world(point.position, point.yaw)
    reached = base_in_world @ flange_poses(arm.robot, point.joints) @ arm.tool
    wanted = cell.task.poses @ cell.grasps(arm, point.free)
    turned = np.swapaxes(wanted[:, :3, :3], 1, 2) @ reached[:, :3, :3]
    joints = np.max(arm.limit_excess(point.joints))
    region = arm.base.bounds
    place = np.array([*point.position, arm.base.yaw_in_interval(point.yaw)])
    base = max(np.max(np.maximum(region[:, 0] - place, place - region[:, 1])), arm.base.yaw_outside(point.yaw))
    return ArmCheck(
        position_error=float(np.max(np.linalg.norm(reached[:, :3, 3] - wanted[:, :3, 3], axis=1))),
        orientation_error=float(np.max(rotation_angle(turned))),
        joint_step=largest_step(cell.task, arm.robot, point.joints),
        limits=float(max(joints, base)),
        posture=_wrong_side(arm, point),
        conditioning=_shortfall(arm, point.joints),
        singularity=float(wrist_shortfall(arm, point.joints.T)),
        max_joint_step=cell.max_joint_step,
        prismatic_step=float(largest_steps(cell.task, point.joints)[0]) if arm.robot.slides else None,
        max_prismatic_step=cell.max_prismatic_step,
        tolerance=_beyond_tolerance(cell, arm, point),
    )


def _beyond_tolerance(cell: Cell, arm: Arm, point: ArmSolution) -> float:
    """How far poses lie outside of what is open there, and how much too fast that changes."""
    if point.free is None or cell.freedom(arm).exact:
        return 0.0
    return max(tolerance_excess(cell, arm, point), cell.freedom(arm).step_excess(point.free, cell.task.joined))


def _wrong_side(arm: Arm, point: ArmSolution) -> float:
    """How far the path goes to the other side of its posture's signs; infinite in a posture that is not admitted."""
    form, signs = closed_form(arm.robot), point.signs
    if form is None:  # the postures of an arm that is not quite as drawn are those of its drawing
        form = posture_form(arm.robot)
        signs = None if form is None else path_signs(form, point.joints)
    if form is None or signs is None:
        return 0.0
    if not arm.posture.admits(signs):
        return float(np.inf)
    return float(np.max(wrong_sides(form, signs, point.joints)))


def wrong_sides(form: ClosedForm, signs: Signs, joints: Floats) -> Floats:
    """(...) how far joints (..., 6) [rad] are on the other side of a posture's signs, <= 0 if they are not."""
    shoulder, elbow, wrist = signs
    front, bend, twist = posture_terms(form, np.moveaxis(joints, -1, 0), np.sin, np.cos)
    sides: Floats = np.maximum(np.maximum(-shoulder * front, shoulder * elbow * bend), -wrist * twist)
    return sides


def _shortfall(arm: Arm, joints: Floats) -> float:
    if arm.min_conditioning is None:
        return 0.0
    length = characteristic_length(arm.robot)
    return arm.min_conditioning - float(np.min(conditioning(arm.robot, arm.tool, joints, length)))


def summarise(checks: list[ArmCheck]) -> Verification:
    """Worst figures over the arms."""
    return Verification(
        max_position_error=max(c.position_error for c in checks),
        max_orientation_error=max(c.orientation_error for c in checks),
        max_joint_step=max(c.joint_step for c in checks),
        limits_respected=all(c.limits <= LIMITS for c in checks),
        max_prismatic_step=max((c.prismatic_step for c in checks if c.prismatic_step is not None), default=None),
        tolerances_respected=all(c.tolerance <= LIMITS for c in checks),
    )
