"""The reduced problem: one arm's cost as a function of its base position alone.

Where joint 1 turns about the base's z axis, a base yaw only shifts joint 1. Then, for a position (x, y, z) and a
posture, the inverse kinematics give the whole path, the best 2π winding of every joint is a rounding and the best yaw
is a clipped mean. So an uncoupled arm is a search over at most three numbers, whatever the length of the task
(docs/method.md, section 2). Everything here is vectorised over positions and postures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.cell.segments import slices
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.branches import Branches, solve_branches, solve_signed
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import ClosedForm, closed_form
from duocell.models.kinematics.difference import SAME, Difference
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.kinematics.wrist_singularity import wrist_shortfall
from duocell.models.objective.objective import JOINT_AVAILABILITY, NOTHING, Objective
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.reduction.further_yaws import take_better_yaws
from duocell.optimizer.reduction.linear_sums import first_joint_limits, keep_sums, sum_excess
from duocell.optimizer.reduction.paths import choose_windings, choose_yaw, unwrap
from duocell.optimizer.reduction.pose_sample import sample_segment


@dataclass(frozen=True, eq=False, slots=True)
class ReducedProblem:
    """Everything about one arm that does not depend on where it stands.

    Attributes:
        arm: the arm.
        form: its closed form.
        sigma: sense of joint 1 about the world's vertical.
        rotations: (m, 3, 3) flange orientations in axes of the mount. positions: (m, 3) m, in the world.
        max_step: rad, allowed joint step; infinite where the poses are not consecutive (a sample of a long task).
        postures: (8,) True for branches the request admits.
        penalty: cost per pose of a metre or radian of violation, in units of the mean weight, in scores: what is nearly
            allowed may be repaired by the local solver, so it competes with what is allowed.
        starts: index of the first pose of each segment of a task sequence.
        weights: (m,) what the poses count for in the objective; None for 1.
        gap_steps: (m - 1,) rad, of a sample: joint step to the next pose that the steps left out between them allow;
            infinite where that says nothing, None if it never does.
        objective: what the cell is to be best at.
        last_open: what is proved must say nothing about steps of the last joint, which stands for a roll that is open.
        apart: by how much the arm that is asked about may be off this one at the same joint values: what is proved
            here has to hold for that arm.
    """

    arm: Arm
    form: ClosedForm
    sigma: int
    rotations: Floats
    positions: Floats
    max_step: float
    postures: Bools
    penalty: float = 8.0
    starts: tuple[int, ...] = (0,)
    weights: Floats | None = None
    gap_steps: Floats | None = None
    apart: Difference = SAME
    objective: Objective = JOINT_AVAILABILITY
    last_open: bool = False

    @property
    def segments(self) -> tuple[slice, ...]:
        """The poses of each segment."""
        return slices(self.starts, len(self.positions))

    @property
    def total_weight(self) -> float:
        """What all poses count for together; their number if that is 0."""
        total = len(self.positions) if self.weights is None else float(np.sum(self.weights))
        return total or len(self.positions)

    def sampled(self, count: int) -> ReducedProblem:
        """The same problem on about ``count`` poses, first and last included; itself if it has no more than that.

        They stand for all poses and have their weight, see `duocell.optimizer.reduction.pose_sample`. Of a task
        sequence, every segment gives a share of its poses.
        """
        m = len(self.positions)
        if m <= count:
            return self
        weights = np.ones(m) if self.weights is None else self.weights
        parts = [
            sample_segment(
                self.rotations[segment],
                self.positions[segment],
                weights[segment],
                -(-count * (segment.stop - segment.start) // m),
            )
            for segment in self.segments
        ]
        counts = [len(chosen) for chosen, _ in parts]
        if sum(counts) == m:
            return self
        keep = np.concatenate(
            [segment.start + chosen for segment, (chosen, _) in zip(self.segments, parts, strict=True)]
        )
        return replace(
            self,
            rotations=self.rotations[keep],
            positions=self.positions[keep],
            max_step=np.inf,
            gap_steps=self._gap_steps(keep),
            starts=tuple(int(start) for start in np.cumsum([0, *counts[:-1]])),
            weights=np.concatenate([own for _, own in parts]),
        )

    def _gap_steps(self, keep: Ints) -> Floats | None:
        """(k - 1,) rad, what the joint steps between kept poses (k,) are limited to; a step is at most half a turn."""
        allowed = np.diff(keep) * self.max_step
        same_segment = np.diff(np.searchsorted(self.starts, keep, side="right")) == 0
        allowed = np.where(same_segment & (allowed < np.pi), allowed, np.inf)
        return allowed if np.any(np.isfinite(allowed)) else None

    def only(self, keep: Ints) -> ReducedProblem:
        """The problem of some of the poses (their indices); steps between them are not limited.

        They stand for all poses of their segments, so that the segments keep their shares of the objective.
        """
        segment_of = np.searchsorted(self.starts, keep, side="right") - 1
        firsts = np.flatnonzero(np.diff(segment_of, prepend=-1))
        problem = replace(
            self,
            rotations=self.rotations[keep],
            positions=self.positions[keep],
            max_step=np.inf,
            gap_steps=None,
            starts=tuple(int(first) for first in firsts),
        )
        if self.weights is None and len(firsts) == 1:
            return problem
        weights = np.ones(len(self.positions)) if self.weights is None else self.weights
        totals = np.add.reduceat(weights, self.starts)[segment_of[firsts]]
        counts = np.diff(np.append(firsts, len(keep)))
        return replace(problem, weights=np.repeat(totals / counts, counts))

    def for_bounds(self) -> ReducedProblem:
        """The same problem with joint availability for its objective, what lower bounds are known of.

        Bounds know weights of joints and of poses; a weight of joint availability becomes one of the poses.
        """
        if self.objective == JOINT_AVAILABILITY:
            return self
        if not self.objective.bounded:
            return replace(self, objective=JOINT_AVAILABILITY)
        counts = np.ones(len(self.positions)) if self.weights is None else self.weights
        return replace(self, objective=JOINT_AVAILABILITY, weights=self.objective.terms[0].weight * counts)

    def stricter(self, factor: float) -> ReducedProblem:
        """The same problem with violations scored ``factor`` times as dear; infinite for feasibility alone."""
        if np.isfinite(factor):
            return replace(self, penalty=self.penalty * factor)
        return replace(self, objective=NOTHING)

    def score(self, objective: Floats, violation: Floats) -> Floats:
        """Objective with what is violated made dear; any equal shapes."""
        score: Floats = objective + self.penalty * self.objective.scale(self.arm) * self.total_weight * violation
        return score


@dataclass(frozen=True, eq=False, slots=True)
class Paths:
    """Best path per posture and position: the answer of the reduced problem.

    Attributes:
        joints: (6, 8, N, m) rad, unwrapped, given windings, joint 1 for the chosen yaw.
        yaw: (8, N) rad, in the allowed interval.
        objective: (8, N) of the arm, also where the path is not allowed.
        missing: (8, N) m, sum over the poses of how far they are out of reach.
        beyond: (8, N) rad, sum over the joints, and the linear limits, of what the path sticks out of the limits.
        jump: (8, N) rad, what the largest joint step exceeds the allowed one by.
        singular: (8, N) rad, by how much the wrist violates its distance from its singularity.
    """

    joints: Floats
    yaw: Floats
    objective: Floats
    missing: Floats
    beyond: Floats
    jump: Floats
    singular: Floats

    @property
    def violation(self) -> Floats:
        """(8, N) one number for how far from allowed a path is: metres and radians added; 0 means usable."""
        return self.missing + self.beyond + self.jump + self.singular


def reduced_problem(cell: Cell, arm: Arm, apart: Difference = SAME) -> ReducedProblem | None:
    """The reduced problem of one arm, or None if the arm has no closed form or no vertical first axis.

    It is that of poses that are given: parameters that they leave open have their nominal values.

    Args:
        cell: task. arm: the arm.
        apart: see `ReducedProblem`.
    """
    form, sigma = closed_form(arm.robot), chain_of(arm.robot).vertical_sign
    if form is None or sigma == 0:
        return None
    targets = cell.flange_targets(arm)
    postures = np.array([arm.posture.admits(signs) for signs in ALL_SIGNS])
    rotations = arm.mount.T @ targets[:, :3, :3]
    return ReducedProblem(
        arm,
        form,
        sigma,
        rotations,
        targets[:, :3, 3],
        cell.max_joint_step,
        postures,
        starts=cell.task.starts,
        weights=None if np.all(cell.task.weights == 1.0) else cell.task.weights,
        apart=apart,
        objective=cell.objective,
        last_open=arm.freedom is not None and arm.freedom.stand_in,
    )


def evaluate(problem: ReducedProblem, positions: Floats) -> Paths:
    """Best path of every posture from every base position.

    Args:
        problem: the arm.
        positions: (N, 3) m, base origins in the world.

    Returns:
        Paths; postures the request excludes have an infinite violation.
    """
    seen = seen_from(problem, positions)
    paths = paths_of(problem, solve_branches(problem.form, problem.rotations, seen))
    paths.jump[~problem.postures] = np.inf
    return paths


def evaluate_signed(problem: ReducedProblem, positions: Floats, signs: Ints) -> Paths:
    """As `evaluate` for one given posture per position: ``signs`` (N, 3); arrays have 1 in place of 8."""
    seen = seen_from(problem, positions)
    return paths_of(problem, solve_signed(problem.form, problem.rotations, seen, signs))


def evaluate_fully(problem: ReducedProblem, positions: Floats, signs: Ints) -> Paths:
    """As `evaluate_signed`; the violation of the conditioning asked for is part of ``jump``."""
    paths = evaluate_signed(problem, positions, signs)
    if problem.arm.min_conditioning is not None:
        paths.jump[0] += conditioning_shortfall(problem, paths.joints[:, 0])
    return paths


def seen_from(problem: ReducedProblem, positions: Floats) -> Floats:
    """(N, m, 3) m: flange positions in the base frames at yaw 0 with origins ``positions`` (N, 3)."""
    seen: Floats = problem.positions - positions[:, None, :]
    return seen if problem.arm.upright else seen @ problem.arm.mount


SINGULAR = 10.0
"""Violation of a path per unit of σmin/σmax by which it is too small: conditioning numbers are small."""


def conditioning_shortfall(problem: ReducedProblem, joints: Floats) -> Floats:
    """Violation of the conditioning asked for by paths (6, L, m): (L,), scaled by `SINGULAR`, 0 where there is none."""
    arm = problem.arm
    flat = joints.reshape(6, -1).T
    values = conditioning_of(chain_of(arm.robot), arm.tool, flat, characteristic_length(arm.robot))
    worst = np.min(values.reshape(joints.shape[1:]), axis=-1)
    shortfall: Floats = SINGULAR * np.maximum(float(arm.min_conditioning or 0.0) - worst, 0.0)
    return shortfall


def paths_of(problem: ReducedProblem, branches: Branches) -> Paths:
    """The best windings and the best yaw of paths (6, B, N, m) that are given modulo 2π."""
    arm = problem.arm
    segments = problem.weights, problem.starts
    if len(branches.missing) == len(ALL_SIGNS):  # the two signs of the wrist are as near to the singularity
        singular = np.repeat(wrist_shortfall(arm, branches.joints[:, ::2]), 2, axis=0)
    else:
        singular = wrist_shortfall(arm, branches.joints)
    joints, step = unwrap(branches.joints, problem.starts)
    beyond = np.zeros(step.shape[1:])
    for i in range(1, 6):
        beyond += choose_windings(joints[i], arm.lower[i], arm.upper[i], arm.reference[i], *segments)
    keep_sums(arm, joints, problem.starts, free_yaw=True)
    first = first_joint_limits(arm, joints)
    yaw, out = choose_yaw(joints[0], *first, arm.reference[0], arm.base, problem.sigma, *segments)
    beyond += sum_excess(arm, joints)
    if problem.objective.keeps_reduction:
        objective = problem.objective.of_paths(arm, joints, problem.weights)
    else:
        yaw, objective = take_better_yaws(problem.objective, arm, joints, yaw, first, problem.sigma, problem.weights)
    jump = np.maximum(np.max(step, axis=0) - problem.max_step, 0.0)
    if problem.gap_steps is not None:
        at = np.flatnonzero(np.isfinite(problem.gap_steps))
        taken = np.max(np.abs(joints[..., at + 1] - joints[..., at]), axis=0)
        jump = np.maximum(jump, np.max(taken - problem.gap_steps[at], axis=-1))
    return Paths(joints, yaw, objective, np.sum(branches.missing, axis=-1), beyond + out, jump, singular)
