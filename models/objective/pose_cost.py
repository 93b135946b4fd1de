"""The cost of one pose as compiled functions: its value and its exact derivatives by the joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.robot.robot import Robot


class Symbolic(Protocol):
    """What has a cost in symbols (`duocell.models.objective.measure.Measure`)."""

    def size(self, robot: Robot) -> int:
        """k, how many numbers of an arm the cost depends on."""

    def expression(self, robot: Robot, joints: ca.SX, numbers: ca.SX) -> ca.SX:
        """The cost of joint values (n,), given the numbers (k,) of an arm."""


@dataclass(frozen=True, eq=False, slots=True)
class PoseCost:
    """Compiled derivatives of a cost; all inputs are joints (n,) and numbers (k,).

    Attributes:
        size: k.
        value: -> (1,). gradient: -> (n,), dense.
        hessian: -> (h,), those entries of the upper triangle that are not always 0.
        pattern: (h, 2) row and column of each.
    """

    size: int
    value: ca.Function
    gradient: ca.Function
    hessian: ca.Function
    pattern: tuple[tuple[int, int], ...]

    def gradients(self, joints: Floats, numbers: Floats) -> Floats:
        """(K, n) at joint values (K, n)."""
        return self._mapped(self.gradient, joints, numbers)

    def hessians(self, joints: Floats, numbers: Floats) -> Floats:
        """(K, n, n) at joint values (K, n)."""
        count, n = joints.shape
        full = np.zeros((count, n, n))
        rows, columns = np.array(self.pattern, dtype=np.int64).reshape(-1, 2).T
        full[:, rows, columns] = full[:, columns, rows] = self._mapped(self.hessian, joints, numbers)
        return full

    def _mapped(self, function: ca.Function, joints: Floats, numbers: Floats) -> Floats:
        """(K, size of the output) for joint values (K, n)."""
        count = len(joints)
        found = function.map(count)(joints.T, np.tile(numbers[:, None], (1, count)))
        result: Floats = np.asarray(found.full()).T
        return result


@lru_cache(maxsize=128)
def pose_cost(measure: Symbolic, robot: Robot) -> PoseCost:
    """Compile the cost of a measure for a robot (cached)."""
    joints = ca.SX.sym("joints", robot.dof)
    numbers = ca.SX.sym("numbers", measure.size(robot))
    cost = ca.densify(measure.expression(robot, joints, numbers))
    hessian, gradient = ca.hessian(cost, joints)
    upper = ca.triu(hessian)
    rows, columns = upper.sparsity().get_triplet()
    entries = ca.sparsity_cast(upper, ca.Sparsity.dense(len(rows), 1))
    options = {"cse": True}
    inputs, names = [joints, numbers], ["joints", "numbers"]
    return PoseCost(
        size=measure.size(robot),
        value=ca.Function("cost", inputs, [cost], names, ["cost"], options),
        gradient=ca.Function("slope", inputs, [ca.densify(gradient)], names, ["slope"], options),
        hessian=ca.Function("bend", inputs, [entries], names, ["bend"], options),
        pattern=tuple(zip(rows, columns, strict=True)),
    )
