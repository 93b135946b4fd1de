"""How well an arm can move its hand into every direction: Yoshikawa's manipulability."""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.sampling import even_points
from duocell.models.kinematics.batch_kinematics import forward_and_jacobian
from duocell.models.kinematics.casadi_kinematics import tool_jacobian
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.objective.measure import Measure
from duocell.models.robot.arm import TURN, Arm
from duocell.models.robot.robot import Robot

LEAST = 1e-9
"""What counts as 0: costs stay finite, so that those of poses that count for nothing add up to nothing."""
DRAWN = 256
"""Postures whose mean says what is typical."""


class Manipulability(Measure):
    """w = √det(J Jᵀ); its cost is 1 / w, so that a path is as good as the harmonic mean over its poses.

    J is the Jacobian of the tool centre point with its linear rows divided by the characteristic length L of the robot
    (`duocell.models.kinematics.kinematics.characteristic_length`), so w has no unit: it is L⁻³ times the value with
    metres. w is 0 at a singularity, from which the cost keeps away. It depends neither on joint 1, which moves the
    whole arm, nor, with six joints or more, on the tool: another point of the hand multiplies J by a matrix of
    determinant 1.
    For arms with fewer than six joints, det(Jᵀ J) takes the place of det(J Jᵀ), which is always 0 there.
    """

    name = "manipulability"
    unit = "1"
    cost_unit = "1"
    source = "T. Yoshikawa, Manipulability of Robotic Mechanisms, Int. J. Robotics Research 4 (2), 1985"
    keeps_reduction = True

    def values(self, arm: Arm, joints: Floats) -> Floats:
        """(...) w at joint values (..., n)."""
        return _manipulability(arm.robot, arm.tool, joints)

    def costs(self, arm: Arm, joints: Floats) -> Floats:
        """(...) 1 / w, in a singularity 1 / `LEAST`."""
        costs: Floats = 1.0 / np.maximum(self.values(arm, joints), LEAST)
        return costs

    def expression(self, robot: Robot, joints: ca.SX, numbers: ca.SX) -> ca.SX:
        """1 / w in symbols: w is the product of the diagonal of the Cholesky factor of J Jᵀ."""
        still = ca.SX(joints)
        still[0] = 0.0  # w does not depend on it, and expressions are half as long
        if robot.dof >= 6:
            still[robot.dof - 1] = 0.0  # likewise: it turns the hand about an axis of which any point will do
        point = numbers if robot.dof < 6 else ca.SX.zeros(3)
        jacobian = ca.sparsify(ca.simplify(ca.substitute(tool_jacobian(robot, joints, point), joints, still)))
        length = characteristic_length(robot)
        jacobian = ca.vertcat(jacobian[:3, :] / length, jacobian[3:, :])
        gram = jacobian @ jacobian.T if robot.dof >= 6 else jacobian.T @ jacobian
        factor = ca.chol(ca.densify(gram))
        product = ca.SX(1.0)
        for k in range(gram.shape[0]):
            product = product * factor[k, k]
        return 1.0 / product

    def size(self, robot: Robot) -> int:
        """The tool centre point, where it matters."""
        return 3 if robot.dof < 6 else 0

    def numbers(self, arm: Arm) -> Floats:
        """(3,) m, tool centre point in the flange frame; nothing where any point will do."""
        return arm.tool[:3, 3] if arm.dof < 6 else np.empty(0)

    def scale(self, arm: Arm) -> float:
        """1 / w of a middling posture."""
        return _typical(arm.robot)


def _manipulability(robot: Robot, tool: Floats, joints: Floats) -> Floats:
    """(...) w at joint values (..., n)."""
    rotations, _, jacobians = forward_and_jacobian(chain_of(robot), joints.reshape(-1, robot.dof))
    offset = rotations @ tool[:3, 3]
    jacobians[:, :3] += np.cross(jacobians[:, 3:], offset[:, :, None], axis=1)
    jacobians[:, :3] /= characteristic_length(robot)
    if robot.dof == 6:
        found = np.abs(np.linalg.det(jacobians))
    else:
        turned = np.swapaxes(jacobians, 1, 2)
        gram = jacobians @ turned if robot.dof > 6 else turned @ jacobians
        found = np.sqrt(np.maximum(np.linalg.det(gram), 0.0))
    result: Floats = found.reshape(joints.shape[:-1])
    return result


@lru_cache(maxsize=128)
def _typical(robot: Robot) -> float:
    """1 over the mean of w over the whole turn of every joint."""
    joints = TURN * even_points(robot.dof, DRAWN, 0)
    return 1.0 / max(float(np.mean(_manipulability(robot, np.eye(4), joints))), 1e-6)
