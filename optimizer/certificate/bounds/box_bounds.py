"""The lower bound of one arm's cost over boxes of base positions, and why a box holds no solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.robot.linear_limits import LinearLimits
from duocell.optimizer.certificate.bounds.angles.expansion import Enclosed, Expansion, enclose, expand
from duocell.optimizer.certificate.bounds.angles.joints import SLACK, Kinematics
from duocell.optimizer.certificate.bounds.angles.targets import Targets
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.bounds.common_shift import common_cost
from duocell.optimizer.certificate.bounds.linear_sums import sums_lost
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.certificate.bounds.tangent import Linearised, linearised, tangent_bounds
from duocell.optimizer.certificate.bounds.together import JOINTS, together_of, wrist_lost
from duocell.optimizer.certificate.bounds.turns import FirstOrder
from duocell.optimizer.certificate.bounds.twist import twist_cost, twist_of
from duocell.optimizer.certificate.bounds.windings import cheapest_windings
from duocell.optimizer.certificate.bounds.yaw import shift_cost, torn, unwrapped
from duocell.optimizer.reduction.reduced import ReducedProblem

PROBES = 8
"""Poses tried first in tasks of more than three times as many."""

FOUR = list(JOINTS)
REACH, LIMIT, PATH, SINGULAR, LINEAR = 1, 2, 3, 4, 5
"""Causes: a pose is out of reach; a joint is outside its limits at a pose; a joint has no continuous path inside; the
wrist is too near to its singularity at a pose; a sum of joints is outside its linear limits at a pose."""
SUMS = 7
"""The row of causes that linear limits have."""


@dataclass(frozen=True, eq=False, slots=True)
class BoxBounds:
    """What is known of N boxes.

    Attributes:
        lower: (N,) no path with its base in the box costs less; inf where there is none.
        promising: (N, 3) m, the place in the box where the cost is probably smallest.
        expected: (N,) about the cost there.
        causes: (8, N) what alone rules the box out, by reach (row 0), by each joint, and by sums of joints (row 7): 0
            or one of the causes.
        poses: (8, N, m) True for the poses concerned.
    """

    lower: Floats
    promising: Floats
    expected: Floats
    causes: Ints
    poses: Bools

    @staticmethod
    def nothing(boxes: Boxes, poses: int) -> BoxBounds:
        """Nothing known yet."""
        n = len(boxes)
        return BoxBounds(
            lower=np.zeros(n),
            promising=boxes.centre.copy(),
            expected=np.full(n, np.inf),
            causes=np.zeros((SUMS + 1, n), dtype=np.int64),
            poses=np.zeros((SUMS + 1, n, poses), dtype=bool),
        )


@dataclass(frozen=True, eq=False, slots=True)
class BoxBounder:
    """Bounds for one reduced problem.

    Attributes:
        rules: limits and objective. kinematics: of the arm and the task.
        probe: the same for a few poses of a long task, to rule boxes out cheaply; None for short tasks.
        probed: indices of these poses.
        linear_limits: of the arm, or None.
    """

    rules: Rules
    kinematics: Kinematics
    probe: BoxBounder | None
    probed: Ints
    linear_limits: LinearLimits | None = None

    @staticmethod
    def of(problem: ReducedProblem, checks: bool = False) -> BoxBounder:
        """Prepare what all boxes share.

        Args:
            problem: of the arm.
            checks: leave room for hands that are off their poses by what a check lets pass; else for rounding alone.
        """
        m = len(problem.positions)
        probe, probed = None, np.zeros(0, dtype=np.int64)
        if m > 3 * PROBES:
            probed = np.linspace(0, m - 1, PROBES).round().astype(np.int64)
            probe = BoxBounder.of(problem.only(probed), checks)
        targets = Targets.of(problem)
        kinematics = Kinematics.of_checks(targets) if checks else Kinematics.of(targets)
        return BoxBounder(Rules.of(problem), kinematics, probe, probed, problem.arm.linear_limits)

    def bounds(self, boxes: Boxes, cutoff: float) -> BoxBounds:
        """Bound every box; no more work is spent on a box once its bound has reached ``cutoff``."""
        found = BoxBounds.nothing(boxes, len(self.kinematics.targets.wrist))
        rows = np.arange(len(boxes))
        if self.probe is not None:
            probed = self.probe.bounds(boxes, 0.0)
            found.causes[:], found.poses[..., self.probed] = probed.causes, probed.poses
            found.lower[np.any(probed.causes > 0, axis=0)] = np.inf
            rows = np.flatnonzero(found.lower < cutoff)
        if len(rows):
            self._all_poses(boxes[rows], rows, cutoff, found)
        return found

    def _all_poses(self, boxes: Boxes, rows: Ints, cutoff: float, found: BoxBounds) -> None:
        """Bound some of the boxes by all poses."""
        targets = self.kinematics.targets
        local = targets.local(boxes)
        angles = self.kinematics.angles(local)
        far = angles.short > SLACK
        lost = np.any(far, axis=1)
        found.poses[0, rows], found.causes[0, rows[lost]], found.lower[rows[lost]] = far, REACH, np.inf
        rows = rows[~lost]
        if not len(rows):
            return
        enclosed = enclose(self.kinematics, local[~lost], angles[~lost])
        costs = self._first_order(enclosed, found, rows)
        found.lower[rows] = costs.total
        keep = found.lower[rows] < cutoff
        if np.any(keep):
            enclosed, rows, half = enclosed[keep], rows[keep], boxes.half[~lost][keep]
            tangent = tangent_bounds(self.rules, *self._expanded(half, enclosed), costs[keep])
            found.lower[rows] = np.maximum(found.lower[rows], tangent.lower)
            found.expected[rows] = tangent.expected
            found.promising[rows, : tangent.step.shape[1]] += tangent.step

    def linearised(self, boxes: Boxes) -> Linearised:
        """The linearised problems of boxes within reach: what `bounds` solves for each of them by itself."""
        local = self.kinematics.targets.local(boxes)
        enclosed = enclose(self.kinematics, local, self.kinematics.angles(local))
        nothing = BoxBounds.nothing(boxes, len(self.kinematics.targets.wrist))
        costs = self._first_order(enclosed, nothing, np.arange(len(boxes)))
        return linearised(self.rules, *self._expanded(boxes.half, enclosed), costs)

    def _expanded(self, half: Floats, enclosed: Enclosed) -> tuple[Floats, Enclosed, Expansion]:
        """Half sides along the directions of the slopes, the enclosure, and its expansion."""
        targets, expansion = self.kinematics.targets, expand(self.kinematics, enclosed)
        if targets.upright:
            return half[:, : targets.dims], enclosed, expansion
        return half, enclosed, expansion.in_world(targets.mount)

    def _first_order(self, enclosed: Enclosed, found: BoxBounds, rows: Ints) -> FirstOrder:
        """Cost of each joint by the size of its interval; inf, and noted, where that allows no path."""
        rules, segments = self.rules, self.rules.segments
        costs = np.zeros((6, len(rows), len(segments)))
        each = np.zeros((6, *enclosed.values.centre.shape[1:]))
        costs[0, :, 0] = self._first_joint(enclosed.values[0], found, rows)
        for i in range(1, 6):
            joint = rules.lower[i], rules.upper[i], rules.reference[i], rules.max_step
            parts = [
                cheapest_windings(enclosed.values[i, :, segment], *joint, rules.share(segment)) for segment in segments
            ]
            cost = np.stack([part.cost for part in parts], axis=-1)
            terms = np.concatenate([part.each for part in parts], axis=-1)
            outside, lost = np.isinf(terms), np.isinf(cost)
            each[i] = np.where(outside, 0.0, rules.weights[i] * np.where(outside, 0.0, terms))
            costs[i] = np.where(lost, np.inf, rules.weights[i] * np.where(lost, 0.0, cost))
            apart = np.concatenate([part.apart for part in parts], axis=-1)
            self._note(found, rows, i, np.any(lost, axis=-1), outside, apart)
        if self.linear_limits is not None:
            outside = sums_lost(self.linear_limits, rules, enclosed.values)
            costs[:, np.any(outside, axis=1)] = np.inf
            self._note_sums(found, rows, outside)
        together = together_of(self.kinematics, rules, enclosed, each, np.all(np.isfinite(costs), axis=(0, 2)))
        if together is None:
            singular = self._note_singular(found, rows, wrist_lost(self.kinematics, rules, enclosed))
            costs[4, singular] = np.inf
            return FirstOrder(costs, self._twist(enclosed, found, rows, costs, each))
        outside = np.isinf(together.cost)
        lost = np.any(outside, axis=1)
        self._note(found, rows, 5, lost, outside, outside)
        self._note_singular(found, rows, together.singular)
        sums = together.sums(each, rules)
        costs[4] = np.where(lost[:, None], np.inf, costs[4])
        kept = np.where(np.isfinite(sums), sums, 0.0) - np.sum(np.where(np.isfinite(costs), costs, 0.0)[FOUR], axis=0)
        return FirstOrder(costs, np.maximum(kept, 0.0), together)

    def _first_joint(self, values: Ball, found: BoxBounds, rows: Ints) -> Floats:
        """(N,) cost of joint 1."""
        rules = self.rules
        joint = rules.lower[0], rules.upper[0], rules.reference[0]
        path, linked = unwrapped(values, rules.max_step, rules.joined)
        shifted = shift_cost(path, linked, *joint, rules.shifts, rules.counts)
        apart = torn(values, rules.max_step, rules.joined)
        gone = np.isinf(shifted.cost)
        cost = np.where(gone, np.inf, rules.weights[0] * np.where(gone, 0.0, shifted.cost))
        known = np.all(linked | ~rules.joined, axis=1) & ~gone
        if len(rules.segments) > 1 and np.any(known):
            cost[known] = np.maximum(cost[known], common_cost(path[known], rules))
            gone = np.isinf(cost)
        lost = np.any(apart, axis=1) | gone
        self._note(found, rows, 0, lost, shifted.outside, apart | gone[:, None])
        return np.where(lost, np.inf, cost)

    def _twist(self, enclosed: Enclosed, found: BoxBounds, rows: Ints, costs: Floats, each: Floats) -> Floats:
        """(N, B) what joints 4 and 6 cost more together than one by one, in each segment."""
        rules = self.rules
        twist = np.zeros(costs.shape[1:])
        stuck = ~np.all(enclosed.regular[3], axis=-1) & np.all(np.isfinite(costs), axis=(0, 2))
        if self.kinematics.twists and np.any(stuck):
            cost = twist_cost(twist_of(self.kinematics, enclosed.angles[stuck]), rules)
            outside = np.isinf(cost)
            lost = np.any(outside, axis=1)
            self._note(found, rows[stuck], 5, lost, outside, outside)
            if rules.counts is not None:
                cost = np.where(outside, np.inf, np.where(outside, 0.0, cost) * rules.counts)
            together = np.maximum(cost, each[3, stuck] + each[5, stuck])
            for b, segment in enumerate(rules.segments):
                more = np.sum(together[:, segment], axis=1) - costs[3, stuck, b] - costs[5, stuck, b]
                twist[stuck, b] = np.maximum(more, 0.0)
        return twist

    @staticmethod
    def _note_singular(found: BoxBounds, rows: Ints, singular: Bools) -> Bools:
        """(N,) True for boxes where some wrist (N, m) is too near to its singularity everywhere, which is noted."""
        lost = np.any(singular, axis=1)
        found.causes[5, rows[lost]] = SINGULAR
        found.causes[6, rows[lost]] = 0
        found.poses[5, rows[lost]] = singular[lost]
        return np.asarray(lost)

    @staticmethod
    def _note_sums(found: BoxBounds, rows: Ints, outside: Bools) -> None:
        """Note boxes where some sum of joints (N, m) is outside its limits everywhere."""
        lost = np.any(outside, axis=1)
        found.causes[SUMS, rows[lost]] = LINEAR
        found.poses[SUMS, rows[lost]] = outside[lost]

    @staticmethod
    def _note(found: BoxBounds, rows: Ints, joint: int, lost: Bools, outside: Bools, apart: Bools) -> None:
        """Note that a joint rules boxes out: by its limits at single poses, or else by its path."""
        single = np.any(outside, axis=1)
        found.causes[joint + 1, rows[lost]] = np.where(single, LIMIT, PATH)[lost]
        found.poses[joint + 1, rows[lost]] = np.where(single[:, None], outside, apart)[lost]
