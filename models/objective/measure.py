"""The form of a measure: all that search, program, proofs and reports ask of what is to be minimised."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.objective.pose_cost import pose_cost
from duocell.models.robot.arm import Arm
from duocell.models.robot.robot import Robot


class Measure(ABC):
    """A figure of one arm at one pose, and what it costs; the cost of a path is the sum over its poses.

    Costs are never negative, and small where the figure is good. They are minimised, so a figure that is to be large
    has a cost that falls with it. Searches compare costs by their ratio.

    A measure has no state of its own: two of a class are one.

    Attributes:
        name: its word in requests and results. unit: of the figure. cost_unit: of the cost.
        source: where the formula is from.
        keeps_reduction: True where the turns of the joints and the base yaw that are best for joint availability are
            as good as any for this measure too. It holds for what depends neither on joint 1 nor on turns of 2π. A
            search of other measures tries further yaws.
        bounded: True where `duocell.optimizer.certificate` knows a lower bound over boxes of bases. Without it an
            answer is never called optimal.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    cost_unit: ClassVar[str]
    source: ClassVar[str]
    keeps_reduction: ClassVar[bool] = False
    bounded: ClassVar[bool] = False

    @abstractmethod
    def values(self, arm: Arm, joints: Floats) -> Floats:
        """(...) the figure, in `unit`, at joint values (..., n)."""

    def costs(self, arm: Arm, joints: Floats) -> Floats:
        """(...) what the figure costs, in `cost_unit`; the figure itself where nothing else is said."""
        return self.values(arm, joints)

    @abstractmethod
    def expression(self, robot: Robot, joints: ca.SX, numbers: ca.SX) -> ca.SX:
        """The cost in symbols: of joint values (n,) and the `numbers` of an arm (k,); derivatives are made of it."""

    def size(self, robot: Robot) -> int:
        """k, how many numbers of an arm `expression` depends on besides its robot."""
        return 0

    def numbers(self, arm: Arm) -> Floats:
        """(k,) these numbers."""
        return np.empty(0)

    @abstractmethod
    def scale(self, arm: Arm) -> float:
        """A typical cost of a pose, in `cost_unit`, positive: what violations and tolerances are measured against."""

    # What follows is derived from the above. A measure with something faster may say so.

    def of_paths(self, arm: Arm, joints: Floats, counts: Floats | None) -> Floats:
        """(...) costs of many paths.

        Args:
            arm: the arm.
            joints: (n, ..., m): joint values first, poses last.
            counts: (m,) what the poses count for; None for 1.
        """
        costs = self.costs(arm, np.moveaxis(joints, 0, -1))
        total: Floats = np.sum(costs, axis=-1) if counts is None else np.sum(costs * counts, axis=-1)
        return total

    def gradient(self, arm: Arm, joints: Floats, counts: Floats) -> Floats:
        """(..., m, n) derivatives of the cost by joint values (..., m, n); ``counts`` (m,) as in `of_paths`."""
        slopes = pose_cost(self, arm.robot).gradients(joints.reshape(-1, arm.dof), self.numbers(arm))
        gradient: Floats = counts[:, None] * slopes.reshape(joints.shape)
        return gradient

    def curvature(self, arm: Arm, joints: Floats, counts: Floats) -> Floats:
        """(m, n, n) second derivatives of the cost by the joint values (m, n) of each pose."""
        curvature: Floats = counts[:, None, None] * pose_cost(self, arm.robot).hessians(joints, self.numbers(arm))
        return curvature

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other)

    def __hash__(self) -> int:
        return hash(type(self))
