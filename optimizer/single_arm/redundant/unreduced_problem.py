"""One arm and some poses as numbers for the unreduced problem: base and every joint of every pose are unknown.

Weights are divided by their means, so that the constants of the search mean the same for every request; positions
are relative to the middle of the base region, so that nothing depends on where the world's origin is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.cell.segments import joined, slices
from duocell.models.kinematics.branches import posture_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.chain_columns import ColumnChain, column_chain
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.objective.objective import JOINT_AVAILABILITY, Objective
from duocell.models.robot.arm import TURN, Arm
from duocell.optimizer.nlp.program import ArmSolution

ENDLESS = 1e9
"""rad; stands for the limit of a joint without end, and for that of a free yaw."""
UPRIGHT = 1.0 - 1e-6
"""Cosine between two axes that are told apart nowhere in the search: of files with rounded angles."""
LEAST_METRIC = 0.05
"""Share of the mean joint weight that a step costs at least in any joint: joints of weight 0 would run away."""
LEAST_WEIGHT = 0.05
"""Share of the mean pose weight that a pose counts for at least where the base is moved: each has to be reached."""


@dataclass(frozen=True, eq=False, slots=True)
class UnreducedProblem:
    """What one arm has to reach, and what that costs.

    Attributes:
        arm: the arm. chain: its kinematics.
        rotations: (m, 3, 3) of the flange targets, in the axes of the mounted base at yaw 0.
        positions: (m, 3) m, of the targets in world axes, seen from ``origin``.
        origin: (3,) m, in the world.
        weights: (m,) of the poses, mean of the positive ones 1.
        starts: of the segments.
        joint_weights: (n,) mean of the positive ones 1. metric: (n,) what a step costs, positive.
        lower: (n,) rad or m, finite. upper: (n,).
        base_lower: (4,) x, y, z [m] seen from ``origin``, yaw [rad]. base_upper: (4,).
        max_step: rad, of joints that turn.
        step_scale: (n,) rad that a unit of a joint's step counts for: 1, or rad per m, so that ``max_step`` is the
            longest step of joints that shift too; 0 where these have none.
        objective: what the cell is to be best at.
    """

    arm: Arm
    chain: ColumnChain
    rotations: Floats
    positions: Floats
    origin: Floats
    weights: Floats
    starts: tuple[int, ...]
    joint_weights: Floats
    metric: Floats
    lower: Floats
    upper: Floats
    base_lower: Floats
    base_upper: Floats
    max_step: float
    step_scale: Floats
    objective: Objective = JOINT_AVAILABILITY

    @property
    def step_limits(self) -> Floats:
        """(n,) rad or m, the longest step of each joint."""
        with np.errstate(divide="ignore"):
            limits: Floats = self.max_step / self.step_scale
        return limits

    @property
    def turns(self) -> Floats:
        """(n,) rad, a whole turn for joints that turn; 0 for those that shift: nothing brings them back."""
        return np.where(self.arm.robot.prismatic, 0.0, TURN)

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.lower)

    @property
    def free(self) -> Ints:
        """Indices of the base coordinates that are not fixed."""
        return np.flatnonzero(self.base_upper > self.base_lower)

    @property
    def reference_column(self) -> Floats:
        """(n, 1) rad, q* of the objective."""
        return self.arm.reference[:, None]

    def costs_of_paths(self, joints: Floats) -> Floats:
        """(K,) objective of paths (n, m, K) per pose, in units of its scale."""
        total = self.objective.of_paths(self.arm, np.moveaxis(joints, 1, -1), self.weights)
        costs: Floats = total / (self.objective.scale(self.arm) * np.sum(self.weights))
        return costs

    def costs_of_poses(self, joints: Floats) -> Floats:
        """(k,) objective of single poses (n, k), in units of its scale."""
        costs: Floats = self.objective.of_poses(self.arm, joints.T) / self.objective.scale(self.arm)
        return costs

    @property
    def base_weights(self) -> Floats:
        """(m,) what the poses count for where the base is moved: all of them have to be reached."""
        return np.maximum(self.weights, LEAST_WEIGHT)

    @property
    def joined(self) -> Bools:
        """(m - 1,) True where the next pose is one of the same segment."""
        return joined(self.starts, len(self.positions))

    @property
    def segments(self) -> tuple[slice, ...]:
        """The poses of each segment."""
        return slices(self.starts, len(self.positions))

    @property
    def endless(self) -> Bools:
        """(n,) True for joints without end."""
        without_end: Bools = self.upper - self.lower >= ENDLESS
        return without_end

    @property
    def endless_yaw(self) -> bool:
        """True if the base may have any yaw, and turns (all but) about the axis of its first joint."""
        upright = abs(float(chain_of(self.arm.robot).axes[0, 2])) > UPRIGHT
        return upright and bool(self.base_upper[3] - self.base_lower[3] >= ENDLESS)

    def only(self, poses: Ints, weights: Floats) -> UnreducedProblem:
        """The same with some of the poses, in order, under other weights (k,)."""
        segments = np.searchsorted(self.starts, poses, side="right") - 1
        starts = tuple(int(k) for k in np.flatnonzero(np.diff(segments, prepend=-1)))
        return replace(
            self, rotations=self.rotations[poses], positions=self.positions[poses], weights=weights, starts=starts
        )

    def narrowed(self, amount: float) -> UnreducedProblem:
        """The same with all limits of joints, and of sums of joints, narrower by ``amount`` [rad or m] at either end.

        Of a joint that shifts at most by a tenth of its range.
        """
        sums, shifts = self.arm.linear_limits, self.arm.robot.prismatic
        less = np.where(shifts, np.minimum(amount, 0.1 * (self.upper - self.lower)), amount)
        arm = self.arm if sums is None else replace(self.arm, linear_limits=sums.narrowed(amount))
        return replace(self, arm=arm, lower=self.lower + less, upper=self.upper - less)

    def moved(self, rotations: Floats, positions: Floats) -> UnreducedProblem:
        """The same with other targets for its poses."""
        return replace(self, rotations=rotations, positions=positions)

    def point(self, joints: Floats, base: Floats) -> ArmSolution:
        """A point of the program from joints (n, m) [rad] and a base (4,), in the posture of a closed form's middle."""
        form, yaw = closed_form(self.arm.robot), self.arm.base.yaw_in_interval(float(base[3]))
        signs = None if form is None else posture_of(form, joints[:, self.segments[0].stop // 2])
        return ArmSolution(base[:3] + self.origin, yaw, joints.T.copy(), signs)


def unreduced_problem(cell: Cell, arm: Arm, box: Floats) -> UnreducedProblem:
    """State the problem of one arm.

    Args:
        cell: task and step limit. arm: the arm. box: (3, 2) m, where the base may stand.
    """
    targets = cell.flange_targets(arm)
    origin = np.mean(box, axis=1)
    yaw = np.array([-ENDLESS, ENDLESS]) if arm.base.yaw_free else arm.base.bounds[3]
    base = np.concatenate([box - origin[:, None], yaw[None]])
    joint_weights = arm.weights / arm.weight_scale
    weights = cell.task.weights / cell.task.weight_scale
    return UnreducedProblem(
        arm=arm,
        chain=column_chain(arm.robot),
        rotations=arm.mount.T @ targets[:, :3, :3],
        positions=targets[:, :3, 3] - origin,
        origin=origin,
        weights=weights if np.any(weights > 0.0) else np.ones(len(weights)),
        starts=cell.task.starts,
        joint_weights=joint_weights,
        metric=np.maximum(joint_weights, LEAST_METRIC),
        lower=np.where(np.isfinite(arm.lower), arm.lower, -ENDLESS),
        upper=np.where(np.isfinite(arm.upper), arm.upper, ENDLESS),
        base_lower=base[:, 0],
        base_upper=base[:, 1],
        max_step=cell.max_joint_step,
        step_scale=cell.max_joint_step / cell.step_limits(arm.robot),
        objective=cell.objective,
    )


@dataclass(frozen=True, eq=False, slots=True)
class Seeds:
    """Bases and paths that are solved side by side.

    Attributes:
        joints: (n, m, K) rad.
        bases: (K, 4) x, y, z [m] seen from the problem's origin, yaw [rad].
    """

    joints: Floats
    bases: Floats

    def __len__(self) -> int:
        return len(self.bases)

    def take(self, which: Ints) -> Seeds:
        """Some of them."""
        return Seeds(self.joints[:, :, which], self.bases[which])

    def join(self, other: Seeds) -> Seeds:
        """These and others."""
        return Seeds(np.concatenate([self.joints, other.joints], axis=2), np.concatenate([self.bases, other.bases]))


def seen_from_bases(problem: UnreducedProblem, bases: Floats) -> tuple[Floats, Floats]:
    """Targets in the base frames: columns of the rotations (3 columns, 3, m·K), positions (3, m·K) [m]."""
    cos, sin = np.cos(bases[:, 3]), np.sin(bases[:, 3])
    m, count = len(problem.positions), len(bases)
    mounted = problem.positions @ problem.arm.mount, bases[:, :3] @ problem.arm.mount
    x, y, z = ((mounted[0][:, a, None] - mounted[1][None, :, a]) for a in range(3))
    positions = np.stack([cos * x + sin * y, cos * y - sin * x, z])
    columns = np.empty((3, 3, m, count))
    for k in range(3):
        x, y, z = (problem.rotations[:, a, k, None] for a in range(3))
        columns[k, 0] = cos * x + sin * y
        columns[k, 1] = cos * y - sin * x
        columns[k, 2] = z
    return columns.reshape(3, 3, m * count), positions.reshape(3, m * count)
