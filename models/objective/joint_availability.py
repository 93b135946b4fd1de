"""How far the joints are from where they have most room on both sides: the objective of the source."""

from __future__ import annotations

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.objective.measure import Measure
from duocell.models.robot.arm import Arm
from duocell.models.robot.robot import Robot


class JointAvailability(Measure):
    """Σ w (q - q*)² over the joints, with weights w and references q* of the arm; 0 is best.

    It is its own cost. Everything about it is in closed form: derivatives here, turns and yaw in
    `duocell.optimizer.reduction`, lower bounds in `duocell.optimizer.certificate`.
    """

    name = "joint_availability"
    unit = "rad²"
    cost_unit = "rad²"
    source = "thesis of 1991, equation (8.21)"
    keeps_reduction = True
    bounded = True

    def values(self, arm: Arm, joints: Floats) -> Floats:
        """(...) weighted squares at joint values (..., n)."""
        values: Floats = np.sum(arm.weights * (joints - arm.reference) ** 2, axis=-1)
        return values

    def expression(self, robot: Robot, joints: ca.SX, numbers: ca.SX) -> ca.SX:
        """The same in symbols."""
        weights, reference = numbers[: robot.dof], numbers[robot.dof :]
        return ca.dot(weights, (joints - reference) ** 2)

    def size(self, robot: Robot) -> int:
        """Weights and references."""
        return 2 * robot.dof

    def numbers(self, arm: Arm) -> Floats:
        """(2n,) weights, then references [rad]."""
        return np.concatenate([arm.weights, arm.reference])

    def scale(self, arm: Arm) -> float:
        """What a joint of middling weight costs a radian from its reference."""
        return arm.weight_scale

    def of_paths(self, arm: Arm, joints: Floats, counts: Floats | None) -> Floats:
        """(...) weighted squares over paths (n, ..., m)."""
        error = joints - arm.reference.reshape(-1, *[1] * (joints.ndim - 1))
        weighted = error if counts is None else error * counts
        total: Floats = np.einsum("i,i...m,i...m->...", arm.weights, error, weighted, optimize=False)
        return total

    def gradient(self, arm: Arm, joints: Floats, counts: Floats) -> Floats:
        """(..., m, n) by joint values (..., m, n)."""
        gradient: Floats = 2.0 * counts[:, None] * arm.weights * (joints - arm.reference)
        return gradient

    def curvature(self, arm: Arm, joints: Floats, counts: Floats) -> Floats:
        """(m, n, n) of joint values (m, n), which it does not depend on."""
        curvature: Floats = 2.0 * counts[:, None, None] * np.diag(arm.weights)
        return curvature
