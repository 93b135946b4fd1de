"""The lower bound of one arm's cost over boxes of base positions, and why a box holds no solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arm import TURN
from models.arrays import Bools, Floats, Ints
from optimizer.bounds.boxes import Boxes
from optimizer.bounds.expansion import Enclosed, enclose, expand
from optimizer.bounds.joints import SLACK, Kinematics
from optimizer.bounds.lifts import cheapest_lifts
from optimizer.bounds.tangent import tangent_bounds
from optimizer.bounds.targets import Targets
from optimizer.bounds.yaw import Shifts, shift_cost, unwrapped
from optimizer.reduced import ReducedProblem

REACH, LIMIT, PATH = 1, 2, 3
"""Causes: a pose is out of reach; a joint is outside its limits at a pose; a joint has no continuous path inside."""


@dataclass(frozen=True, eq=False, slots=True)
class BoxBounds:
    """What is known of N boxes.

    Attributes:
        lower: (N,) no path with its base in the box costs less; inf where there is none.
        cause: (N,) why there is none: 0 (there may be one), REACH, LIMIT or PATH.
        joint: (N,) index of the joint that is the cause, -1 for reach.
        poses: (N, m) True for the poses that are the cause.
        promising: (N, 3) m, a place in the box where the cost is probably small.
    """

    lower: Floats
    cause: Ints
    joint: Ints
    poses: Bools
    promising: Floats


@dataclass(frozen=True, eq=False, slots=True)
class BoxBounder:
    """Bounds for one reduced problem."""

    problem: ReducedProblem
    kinematics: Kinematics
    shifts: Shifts

    @staticmethod
    def of(problem: ReducedProblem) -> BoxBounder:
        """Prepare what all boxes share."""
        yaw, sigma = problem.arm.base.yaw, problem.sigma
        start = min(-sigma * yaw.low, -sigma * yaw.high) - SLACK
        shifts = Shifts(start, yaw.width + 2.0 * SLACK, problem.arm.base.yaw_free or yaw.width >= TURN - 1e-6)
        return BoxBounder(problem, Kinematics.of(Targets.of(problem)), shifts)

    def bounds(self, boxes: Boxes, cutoff: float) -> BoxBounds:
        """Bound every box; no more work is spent on a box once its bound has reached ``cutoff``."""
        n, m = len(boxes), len(self.problem.positions)
        found = BoxBounds(
            np.zeros(n), np.zeros(n, dtype=np.int64), np.full(n, -1), np.zeros((n, m), dtype=bool), boxes.centre.copy()
        )
        angles = self.kinematics.angles(boxes)
        far = np.abs(angles.short) > SLACK
        lost = np.any(far, axis=1)
        found.lower[lost], found.cause[lost], found.poses[lost] = np.inf, REACH, far[lost]
        rows = np.flatnonzero(~lost)
        enclosed = enclose(self.kinematics, boxes[rows], angles[rows])
        costs = self._first_order(enclosed, found, rows)
        found.lower[rows] = np.sum(costs, axis=0)
        keep = found.lower[rows] < cutoff
        rows = rows[keep]
        self._second_order(enclosed[keep], costs[:, keep], found, rows)
        return found

    def _first_order(self, enclosed: Enclosed, found: BoxBounds, rows: Ints) -> Floats:
        """(6, n) cost of each joint by the size of its interval; marks the boxes without a path."""
        arm, max_step = self.problem.arm, self.problem.max_step
        costs = np.zeros((6, len(rows)))
        for i in range(6):
            values, (lower, upper) = enclosed.values[i], (arm.lower[i] - SLACK, arm.upper[i] + SLACK)
            if i == 0:
                path, linked = unwrapped(values, max_step)
                cost = shift_cost(path, linked, lower, upper, arm.reference[0], self.shifts)
                outside = np.zeros(values.centre.shape, dtype=bool)
            else:
                lifted = cheapest_lifts(values, lower, upper, arm.reference[i], max_step)
                cost, outside = lifted.cost, lifted.outside
            lost = np.isinf(cost)
            costs[i] = np.where(lost, np.inf, arm.weights[i] * np.where(lost, 0.0, cost))
            new = lost & (found.cause[rows] == 0)
            single = np.any(outside, axis=1)
            found.cause[rows[new]] = np.where(single[new], LIMIT, PATH)
            found.joint[rows[new]] = i
            found.poses[rows[new]] = np.where(single[new, None], outside[new], True)
        return costs

    def _second_order(self, enclosed: Enclosed, costs: Floats, found: BoxBounds, rows: Ints) -> None:
        """Raise the bounds of some rows by tangents."""
        if not len(rows):
            return
        expansion = expand(self.kinematics, enclosed)
        problem = self.problem
        lower, step = tangent_bounds(problem.arm, problem.max_step, self.shifts, enclosed, expansion, costs)
        found.lower[rows] = np.maximum(found.lower[rows], lower)
        found.promising[rows, : step.shape[1]] += step
