"""An arm of a cell: a robot with its tool, its grasp on the part, where it may stand and what it should prefer."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import pi

import numpy as np

from duocell.models.base.arrays import Floats, set_frozen
from duocell.models.base.pose import rotation_z, transform
from duocell.models.base.weights import check_weights
from duocell.models.robot.freedom import Freedom
from duocell.models.robot.linear_limits import LinearLimits
from duocell.models.robot.posture import Posture
from duocell.models.robot.robot import Robot

TURN = 2.0 * pi
ROUNDING = 1e-12
"""rad"""
NARROWEST = 1e-4
"""rad; a joint with less range is no joint."""
SINGULAR_WRIST = 1e-3
"""rad; a pose whose wrist is nearer than this to its singularity is not usable, unless the arm is told to allow it."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A closed interval; ``low == high`` means fixed."""

    low: float
    high: float

    @property
    def fixed(self) -> bool:
        """True where there is nothing to choose."""
        return self.low == self.high

    @property
    def width(self) -> float:
        """high - low."""
        return self.high - self.low

    @property
    def middle(self) -> float:
        """Centre of the interval."""
        return 0.5 * (self.low + self.high)

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high


FREE_YAW = Interval(-pi, pi)


@dataclass(frozen=True, slots=True)
class BaseRegion:
    """Where a base may stand: x, y, z [m] of its origin and yaw [rad] about the world's vertical.

    ``yaw`` counts modulo 2π; a width of 2π or more means free.
    """

    x: Interval
    y: Interval
    z: Interval
    yaw: Interval = FREE_YAW

    @property
    def yaw_free(self) -> bool:
        """True if every yaw is allowed."""
        return self.yaw.width >= TURN - ROUNDING

    @property
    def bounds(self) -> Floats:
        """(4, 2) low and high of x, y, z, yaw."""
        return np.array([[i.low, i.high] for i in (self.x, self.y, self.z, self.yaw)])

    def yaw_in_interval(self, yaw: float) -> float:
        """The representative of ``yaw`` modulo 2π that is in the interval, or else the interval's nearer end."""
        low, high = self.yaw.low, self.yaw.high
        above = low + (yaw - low) % TURN
        if above <= high:
            return above
        return high if above - high <= low - (above - TURN) else low

    def yaw_outside(self, yaw: float) -> float:
        """How far ``yaw`` [rad] is outside the interval, modulo 2π; 0 if it is allowed."""
        return abs((yaw - self.yaw_in_interval(yaw) + pi) % TURN - pi)


@dataclass(frozen=True, eq=False)
class Arm:
    """One arm of a cell.

    Attributes:
        name: unique in its cell.
        robot: the kinematic chain.
        tool: (4, 4) tool centre point (TCP) in the flange frame.
        grasp: (4, 4) TCP in the object frame, T_C^H of the source.
        grasps: (segments, 4, 4) the same for each segment of the task, or None where ``grasp`` holds for all of them.
        base: where the base may stand.
        lower: (n,) rad or m, limits in force; ``-inf`` for a joint without end. upper: (n,) likewise.
        reference: (n,) rad or m, q* of the objective (8.21).
        weights: (n,) w of the objective; 0 for joints without limits.
        posture: signs the user insists on; None entries are free.
        min_conditioning: smallest allowed σmin/σmax of the Jacobian along the path, or None.
        mount: (3, 3) base orientation in the world at yaw 0; the yaw turns about the base's own z axis.
        avoid_singularities: refuse poses at which the wrist is within `SINGULAR_WRIST` of its singularity.
        linear_limits: limits between the joints, or None without any.
        freedom: what the poses of the task leave open, or None: all six coordinates are given.

    Raises:
        InvalidInput: a weight that is out of range (`duocell.models.base.weights`).
    """

    name: str
    robot: Robot
    tool: Floats
    grasp: Floats
    base: BaseRegion
    lower: Floats
    upper: Floats
    reference: Floats
    weights: Floats
    posture: Posture = Posture()
    min_conditioning: float | None = None
    mount: Floats = field(default_factory=lambda: np.eye(3))
    grasps: Floats | None = None
    avoid_singularities: bool = True
    linear_limits: LinearLimits | None = None
    freedom: Freedom | None = None

    def __post_init__(self) -> None:
        n = self.robot.dof
        set_frozen(self, "tool", self.tool, (4, 4))
        set_frozen(self, "grasp", self.grasp, (4, 4))
        if self.grasps is not None:
            set_frozen(self, "grasps", self.grasps, (None, 4, 4))
        set_frozen(self, "mount", self.mount, (3, 3))
        for name in ("lower", "upper", "reference", "weights"):
            set_frozen(self, name, getattr(self, name), (n,))
        check_weights(self.weights, "/weights")

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self.robot.dof

    @property
    def travel(self) -> tuple[float, float] | None:
        """m, limits in force of the linear axis that carries the arm; None without one."""
        return (float(self.lower[0]), float(self.upper[0])) if self.robot.slides else None

    @cached_property
    def weight_scale(self) -> float:
        """Mean of the weights that are not zero (1 without any): what a cost is to be measured against."""
        positive = self.weights[self.weights > 0.0]
        return float(np.mean(positive)) if len(positive) else 1.0

    # What has limits are the joints, and after them the sums of the linear limits: n + k values in this order.

    def bounded(self, joints: Floats) -> Floats:
        """(..., n + k) rad, all that has limits at joint values (..., n): these, then the sums of `linear_limits`."""
        if self.linear_limits is None:
            return joints
        return np.concatenate([joints, self.linear_limits.values(joints)], axis=-1)

    @cached_property
    def bounded_lower(self) -> Floats:
        """(n + k,) rad, lower limits of what is `bounded`."""
        return self.lower if self.linear_limits is None else np.concatenate([self.lower, self.linear_limits.lower])

    @cached_property
    def bounded_upper(self) -> Floats:
        """(n + k,) rad, likewise."""
        return self.upper if self.linear_limits is None else np.concatenate([self.upper, self.linear_limits.upper])

    @cached_property
    def bounded_slopes(self) -> Floats:
        """(n + k, n) derivatives of what is `bounded` by the joints."""
        own = np.eye(self.dof)
        return own if self.linear_limits is None else np.concatenate([own, self.linear_limits.matrix])

    def bounded_sizes(self, sizes: Floats) -> Floats:
        """(..., n + k) rad that what is `bounded` changes by at most where the joints change by ``sizes`` (..., n)."""
        return sizes if self.linear_limits is None else sizes @ np.abs(self.bounded_slopes.T)

    @property
    def bounded_names(self) -> tuple[str, ...]:
        """Names of what is `bounded`."""
        return self.robot.joint_names + (() if self.linear_limits is None else self.linear_limits.names)

    @property
    def bounded_units(self) -> tuple[str, ...]:
        """Units of what is `bounded`; linear limits are about joints that turn."""
        rows = 0 if self.linear_limits is None else len(self.linear_limits)
        return tuple(kind.unit for kind in self.robot.joint_kinds) + rows * ("rad",)

    def limit_excess(self, joints: Floats) -> Floats:
        """(..., n + k) rad by which what is `bounded` lies beyond its limits; negative: what is left."""
        bounded = self.bounded(joints)
        excess: Floats = np.maximum(self.bounded_lower - bounded, bounded - self.bounded_upper)
        return excess

    @cached_property
    def turns_matter(self) -> bool:
        """True if a joint of a linear limit has a turn or more: the sum then depends on which turn it is on."""
        if self.linear_limits is None:
            return False
        used = np.any(self.linear_limits.matrix != 0.0, axis=0)
        return bool(np.any((self.upper - self.lower)[used & ~self.robot.prismatic] >= TURN))

    @property
    def upright(self) -> bool:
        """True if the base stands on the floor: its z axis is the world's."""
        return bool(np.array_equal(self.mount, np.eye(3)))

    def base_in_world(self, position: Floats, yaw: Floats | float) -> Floats:
        """(..., 4, 4) base frame in the world from base origins (..., 3) [m] and yaws (...) [rad]."""
        return transform(self.mount @ rotation_z(yaw), position)

    def in_segment(self, segment: int) -> Arm:
        """The same arm for one segment of the task by itself."""
        return self if self.grasps is None else replace(self, grasp=self.grasps[segment], grasps=None)

    def __repr__(self) -> str:
        return f"Arm({self.name!r}, {self.robot.name!r})"


def range_weights(lower: Floats, upper: Floats) -> Floats:
    """Weights (8.8) of the source: ``w_i = (max_k range_k)² / range_i²``; 0 for joints without limits.

    Args:
        lower: (n,) rad or m. upper: (n,) likewise; infinite where the joint turns without end.

    Returns:
        (n,) dimensionless.
    """
    ranges = upper - lower
    finite = np.isfinite(ranges) & (ranges > 0.0)
    widest = float(np.max(ranges[finite], initial=0.0))
    weights = np.zeros_like(ranges)
    weights[finite] = (widest / ranges[finite]) ** 2
    return weights


def equal_weights(lower: Floats, upper: Floats) -> Floats:
    """Weights 1 for joints with limits, 0 for joints without end."""
    return np.isfinite(upper - lower).astype(np.float64)
