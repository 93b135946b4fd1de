"""What seeds are worth, and which of them are the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.kinematics.chain_columns import rotation_vectors
from duocell.models.robot.arm import TURN
from duocell.optimizer.parameters.unreduced import UnreducedParameters
from duocell.optimizer.reduction.linear_sums import keep_sums, sum_excess
from duocell.optimizer.single_arm.redundant.conditioning_pull import conditioning_values
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, seen_from_bases

WHOLE = 1e-3
"""Share of a turn by which a winding may seem to break a limit."""


@dataclass(frozen=True, eq=False, slots=True)
class Figures:
    """Figures of seeds, each (K,).

    Attributes:
        cost: E per pose, in units of the mean weights.
        over: rad, farthest beyond a limit. step: rad, longest within a segment. error: m or rad, largest of any pose.
        violation: of the conditioning asked for, 0 if none is.
    """

    cost: Floats
    over: Floats
    step: Floats
    error: Floats
    violation: Floats

    def take(self, which: Ints) -> Figures:
        """Those of some seeds."""
        return Figures(self.cost[which], self.over[which], self.step[which], self.error[which], self.violation[which])

    def score(self, allowed: float, parameters: UnreducedParameters) -> Floats:
        """Cost with what is broken made dear; ``allowed`` [rad] is the longest step."""
        worst = parameters.over_penalty * np.minimum(self.over, 1.0)
        worst += parameters.step_penalty * np.maximum(self.step - allowed, 0.0)
        worst += parameters.error_penalty * np.minimum(self.error, 1.0)
        score: Floats = self.cost + worst
        return score


def figures(problem: UnreducedProblem, seeds: Seeds, conditioning: float = 0.0) -> Figures:
    """Look at seeds; their conditioning only if some is asked for."""
    q = seeds.joints
    n, m, count = q.shape
    flat = q.reshape(n, m * count)
    columns, position = problem.chain.forward(flat)
    wanted, targets = seen_from_bases(problem, seeds.bases)
    error = np.maximum(
        np.max(np.abs(targets - position), axis=0), np.max(np.abs(rotation_vectors(columns, wanted)), axis=0)
    )
    low, high = np.min(q, axis=1), np.max(q, axis=1)
    over = np.maximum(problem.lower[:, None] - low, high - problem.upper[:, None])
    steps = np.abs(np.diff(q, axis=1))[:, problem.joined] * problem.step_scale[:, None, None]
    violation = np.zeros(count)
    if conditioning > 0.0:
        values = conditioning_values(problem, flat).reshape(m, count)
        violation = np.maximum(conditioning - np.min(values, axis=0), 0.0)
    return Figures(
        cost=problem.costs_of_paths(q),
        over=np.maximum(np.maximum(np.max(over, axis=0), sum_excess(problem.arm, np.moveaxis(q, 1, -1))), 0.0),
        step=np.max(steps, axis=(0, 1), initial=0.0),
        error=np.max(error.reshape(m, count), axis=0),
        violation=violation,
    )


def best_windings(problem: UnreducedProblem, seeds: Seeds) -> Seeds:
    """Seeds whose joints take the turns nearest to the reference that the limits leave, segment by segment."""
    joints = seeds.joints.copy()
    reference = problem.reference_column
    low, high = problem.lower[:, None], problem.upper[:, None]
    for segment in problem.segments:
        part, weights = joints[:, segment], problem.weights[segment]
        total = float(np.sum(weights))
        mean = np.einsum("ijk,j->ik", part, weights) / total if total > 0.0 else np.mean(part, axis=1)
        least, most = np.min(part, axis=1), np.max(part, axis=1)
        first, last = np.ceil((low - least) / TURN - WHOLE), np.floor((high - most) / TURN + WHOLE)
        turns = np.round((reference - mean) / TURN)
        central = np.round((0.5 * (low + high) - 0.5 * (least + most)) / TURN)
        part += (problem.turns[:, None] * np.where(first <= last, np.clip(turns, first, last), central))[:, None]
    keep_sums(problem.arm, np.moveaxis(joints, 1, -1), problem.starts, free_yaw=False)
    return Seeds(joints, seeds.bases)


def distinct(problem: UnreducedProblem, seeds: Seeds, order: Ints, most: int, joints: float, base: float) -> Ints:
    """The first ``most`` of ``order`` (best first), without what is near an earlier one.

    Two are near where no joint differs by more than ``joints`` [rad] at the ends and in the middle of the path, and no
    coordinate of the base by more than ``base`` [m]; joints without end by whole turns more, see `_marks`.
    """
    m = seeds.joints.shape[1]
    looked_at = np.concatenate(_marks(problem, seeds.joints[:, [0, (m - 1) // 2, m // 2, m - 1]]))
    marks = np.concatenate([looked_at / joints, seeds.bases[:, :3].T / base])[:, order]
    alive: Bools = np.ones(len(order), dtype=np.bool_)
    kept = []
    for k in range(len(order)):
        if alive[k]:
            kept.append(k)
            if len(kept) >= most:
                break
            alive &= np.max(np.abs(marks - marks[:, k, None]), axis=0) > 1.0
    return order[kept]


def _marks(problem: UnreducedProblem, joints: Floats) -> Floats:
    """(i, 4, K) what tells paths apart, from joints (n, 4, K) of some of their poses [rad].

    A joint without end is where it is whatever its turn. The first one, where it is without end and costs nothing, has
    any value under a base that may have any yaw: copies of one layout would fill every list.
    """
    endless = problem.endless
    around = joints[endless]
    if endless[0] and problem.joint_weights[0] == 0.0 and problem.endless_yaw:
        around = around[1:]
    return np.concatenate([joints[~endless], np.cos(around), np.sin(around)])
