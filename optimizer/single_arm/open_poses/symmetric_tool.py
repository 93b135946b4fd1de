"""A free roll about the axis of the last joint: the search of given poses, in which that joint costs nothing.

There the roll only shifts joint 6, so joint 6 may stand at its reference all along, whatever the others do; the roll
follows from the poses. What is left is the reduced problem of given poses with neither weight nor limits on joint 6:
the same search, the same proofs (docs/method.md, section 4.2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_vector
from duocell.models.cell.cell import Cell
from duocell.models.cell.pose_freedom import PoseFreedom
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Arm
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.tolerances import parameters_of

ROLL = 7
"""The parameter that is a turn about the z axis of a displacement."""
ON_AXIS = 1e-9
"""m and rad by which two axes that are one may seem to differ."""


@dataclass(frozen=True, eq=False, slots=True)
class SymmetricTool:
    """The task with the roll given, for an arm that does not mind its last joint.

    Attributes:
        cell: of the arm whose poses are given. arm: without weight and limits on its last joint.
        true_cell, true_arm: what was asked for. whole: True if the roll is free at every pose; else what is proved of
            the task with the roll given still holds, but not all that is found.
    """

    cell: Cell
    arm: Arm
    true_cell: Cell
    true_arm: Arm
    whole: bool

    @staticmethod
    def of(cell: Cell, arm: Arm) -> SymmetricTool | None:
        """Of an arm whose poses leave only a roll about the axis of its last joint open, or None."""
        freedom, last = cell.freedom(arm), arm.dof - 1
        if arm.freedom is None or freedom.kind != (ROLL,) or closed_form(arm.robot) is None:
            return None
        linked = arm.linear_limits is not None and bool(np.any(arm.linear_limits.matrix[:, last]))
        if linked or not _is_about_last_joint(arm, freedom):
            return None
        lower, upper, weights = arm.lower.copy(), arm.upper.copy(), arm.weights.copy()
        lower[last], upper[last], weights[last] = -np.inf, np.inf, 0.0
        given = replace(arm.freedom.fixed(freedom.all_values(_steadiest_roll(freedom))), stand_in=True)
        stand_in = replace(arm, lower=lower, upper=upper, weights=weights, freedom=given)
        arms = tuple(stand_in if one is arm else one for one in cell.arms)
        return SymmetricTool(replace(cell, arms=arms), stand_in, cell, arm, bool(np.all(np.isinf(freedom.upper))))

    def lifted(self, point: ArmSolution) -> ArmSolution:
        """A point of the stand-in as one of the arm: its last joint at its reference, and the roll that this takes."""
        arm, joints = self.true_arm, point.joints.copy()
        joints[:, -1] = np.clip(arm.reference[-1], arm.lower[-1], arm.upper[-1])
        flanges = arm.base_in_world(point.position, point.yaw) @ flange_poses(arm.robot, joints)
        roll = parameters_of(self.true_cell.freedom(arm), flanges)[:, ROLL]
        return replace(point, joints=joints, free=np.unwrap(roll)[:, None])


def _is_about_last_joint(arm: Arm, freedom: PoseFreedom) -> bool:
    """True if the z axis of every displacement is the axis of the last joint."""
    chain, back = chain_of(arm.robot), inverse(freedom.after)
    axis = chain.home[:3, :3].T @ chain.axes[-1]
    point = chain.home[:3, :3].T @ (chain.points[-1] - chain.home[:3, 3])
    directions, places = back[:, :3, 2], back[:, :3, 3]
    tilted = np.linalg.norm(np.cross(directions, axis), axis=1)
    beside = np.linalg.norm(np.cross(places - point, axis), axis=1)
    return bool(np.max(tilted) < ON_AXIS and np.max(beside) < ON_AXIS)


def _steadiest_roll(freedom: PoseFreedom) -> Floats:
    """(m, 1) rad, the roll with which the hand turns about its axis as little as possible from pose to pose.

    Steps of the last joint, which stands still in the end, then hardly ever say anything.
    """
    hands = freedom.before[:, :3, :3]
    turns = rotation_vector(hands[:-1].swapaxes(1, 2) @ hands[1:])[:, 2]
    roll: Floats = -np.concatenate([[0.0], np.cumsum(turns)])[:, None]
    return roll
