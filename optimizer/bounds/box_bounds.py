"""The lower bound of one arm's cost over boxes of base positions, and why a box holds no solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import Bools, Floats, Ints
from optimizer.bounds.boxes import Boxes
from optimizer.bounds.expansion import Enclosed, enclose, expand
from optimizer.bounds.joints import SLACK, Kinematics
from optimizer.bounds.lifts import cheapest_lifts
from optimizer.bounds.rules import Rules
from optimizer.bounds.tangent import tangent_bounds
from optimizer.bounds.targets import Targets
from optimizer.bounds.yaw import shift_cost, torn, unwrapped
from optimizer.reduced import ReducedProblem

REACH, LIMIT, PATH = 1, 2, 3
"""Causes: a pose is out of reach; a joint is outside its limits at a pose; a joint has no continuous path inside."""


@dataclass(frozen=True, eq=False, slots=True)
class BoxBounds:
    """What is known of N boxes.

    Attributes:
        lower: (N,) no path with its base in the box costs less; inf where there is none.
        promising: (N, 3) m, the place in the box where the cost is probably smallest.
        expected: (N,) about the cost there.
        causes: (7, N) what alone rules the box out, by reach (row 0) and by each joint: 0 or one of the causes.
        poses: (7, N, m) True for the poses concerned.
    """

    lower: Floats
    promising: Floats
    expected: Floats
    causes: Ints
    poses: Bools


@dataclass(frozen=True, eq=False, slots=True)
class BoxBounder:
    """Bounds for one reduced problem."""

    rules: Rules
    kinematics: Kinematics

    @staticmethod
    def of(problem: ReducedProblem) -> BoxBounder:
        """Prepare what all boxes share."""
        return BoxBounder(Rules.of(problem), Kinematics.of(Targets.of(problem)))

    def bounds(self, boxes: Boxes, cutoff: float) -> BoxBounds:
        """Bound every box; no more work is spent on a box once its bound has reached ``cutoff``."""
        n, m = len(boxes), len(self.kinematics.targets.wrist)
        found = BoxBounds(
            lower=np.zeros(n),
            promising=boxes.centre.copy(),
            expected=np.full(n, np.inf),
            causes=np.zeros((7, n), dtype=np.int64),
            poses=np.zeros((7, n, m), dtype=bool),
        )
        angles = self.kinematics.angles(boxes)
        found.poses[0] = np.abs(angles.short) > SLACK
        lost = np.any(found.poses[0], axis=1)
        found.causes[0, lost], found.lower[lost] = REACH, np.inf
        rows = np.flatnonzero(~lost)
        if len(rows):
            enclosed = enclose(self.kinematics, boxes[rows], angles[rows])
            costs = self._first_order(enclosed, found, rows)
            found.lower[rows] = np.sum(costs, axis=0)
            keep = found.lower[rows] < cutoff
            if np.any(keep):
                self._second_order(enclosed[keep], costs[:, keep], found, rows[keep])
        return found

    def _first_order(self, enclosed: Enclosed, found: BoxBounds, rows: Ints) -> Floats:
        """(6, n) cost of each joint by the size of its interval; inf, and noted, where that allows no path."""
        rules = self.rules
        costs = np.zeros((6, len(rows)))
        for i in range(6):
            values, joint = enclosed.values[i], (rules.lower[i], rules.upper[i], rules.reference[i])
            if i == 0:
                path, linked = unwrapped(values, rules.max_step)
                shifted = shift_cost(path, linked, *joint, rules.shifts)
                apart = torn(values, rules.max_step)
                cost, outside = np.where(np.any(apart, axis=1), np.inf, shifted.cost), shifted.outside
                apart |= np.isinf(shifted.cost)[:, None]
            else:
                lifted = cheapest_lifts(values, *joint, rules.max_step)
                cost, outside, apart = lifted.cost, lifted.outside, lifted.apart
            costs[i] = np.where(np.isinf(cost), np.inf, rules.weights[i] * np.where(np.isinf(cost), 0.0, cost))
            lost = np.isinf(cost)
            single = np.any(outside, axis=1)
            found.causes[i + 1, rows[lost]] = np.where(single, LIMIT, PATH)[lost]
            found.poses[i + 1, rows[lost]] = np.where(single[:, None], outside, apart)[lost]
        return costs

    def _second_order(self, enclosed: Enclosed, costs: Floats, found: BoxBounds, rows: Ints) -> None:
        """Raise the bounds of some rows by the tangents of their squares."""
        tangent = tangent_bounds(self.rules, enclosed, expand(self.kinematics, enclosed), costs)
        found.lower[rows] = np.maximum(found.lower[rows], tangent.lower)
        found.expected[rows] = tangent.expected
        found.promising[rows, : tangent.step.shape[1]] += tangent.step
