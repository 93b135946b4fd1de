"""A batch of placements of one arm: bases in postures, with the paths that suit them best and what these cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.robot.arm import TURN
from duocell.models.robot.posture import ALL_SIGNS, signs_from
from duocell.optimizer.coupled.candidates.followed import FollowedProblem
from duocell.optimizer.coupled.candidates.unknowns import Samples
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem, conditioning_shortfall

AT_ONCE = 60_000
"""Postures of all poses that are evaluated in one go: what fits into a cache."""


@dataclass(frozen=True, eq=False, slots=True)
class Placements:
    """Placements of one arm.

    Attributes:
        positions: (N, 3) m. yaws: (N,) rad. joints: (N, m, 6) rad. signs: (N, 3) postures. objective: (N,) E.
        groups: (N,) numbers of the values that the tied coordinates have.
        cells: (N, 3) m, the positions in axes that turn with the task.
    """

    positions: Floats
    yaws: Floats
    joints: Floats
    signs: Ints
    objective: Floats
    groups: Ints
    cells: Floats

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def bases(self) -> Floats:
        """(4, N) x, y, z and yaw."""
        return np.vstack([self.positions.T, self.yaws])

    def take(self, rows: Ints | Bools) -> Placements:
        """Some of them."""
        return Placements(
            self.positions[rows],
            self.yaws[rows],
            self.joints[rows],
            self.signs[rows],
            self.objective[rows],
            self.groups[rows],
            self.cells[rows],
        )

    @staticmethod
    def joined(parts: Sequence[Placements]) -> Placements:
        """All in one."""
        return Placements(
            np.concatenate([part.positions for part in parts]),
            np.concatenate([part.yaws for part in parts]),
            np.concatenate([part.joints for part in parts]),
            np.concatenate([part.signs for part in parts]),
            np.concatenate([part.objective for part in parts]),
            np.concatenate([part.groups for part in parts]),
            np.concatenate([part.cells for part in parts]),
        )

    def point(self, row: int) -> ArmSolution:
        """One of them."""
        return ArmSolution(self.positions[row], float(self.yaws[row]), self.joints[row], signs_from(self.signs[row]))

    def turns(self, problem: ReducedProblem) -> Floats:
        """(N, 2) rad, by how much a base may turn under its arm at least and at most."""
        arm = problem.arm
        first = problem.sigma * self.joints[:, :, 0]
        low, high = sorted((problem.sigma * arm.lower[0], problem.sigma * arm.upper[0]))
        least, most = first.max(axis=1) - high, first.min(axis=1) - low
        if not arm.base.yaw_free:
            least = np.maximum(least, arm.base.yaw.low - self.yaws)
            most = np.minimum(most, arm.base.yaw.high - self.yaws)
        return np.stack([np.minimum(least, 0.0), np.maximum(most, 0.0)], axis=-1)

    def turned(self, problem: ReducedProblem, by: Floats) -> Placements:
        """All with their bases turned by (N,) rad, within `turns`, under arms that stay where they are."""
        arm, joints = problem.arm, self.joints.copy()
        joints[:, :, 0] -= problem.sigma * by[:, None]
        yaws = self.yaws + by
        if arm.base.yaw_free:
            yaws = (yaws + 0.5 * TURN) % TURN - 0.5 * TURN
        cost = problem.objective.of_paths(arm, joints.transpose(2, 0, 1), problem.weights)
        return replace(self, yaws=yaws, joints=joints, objective=cost)


def placements_at(problem: FollowedProblem, samples: Samples) -> Placements:
    """All usable placements at sampled positions, cheapest first."""
    parts = list(_usable(problem, samples))
    if not parts:
        return nothing(problem.problem)
    every = Placements.joined(parts)
    return every.take(np.argsort(every.objective, kind="stable"))


def _usable(problem: FollowedProblem, samples: Samples) -> Iterator[Placements]:
    """Usable placements of every chunk of positions."""
    chunk = max(1, AT_ONCE // (len(ALL_SIGNS) * len(problem.problem.positions)))
    for at in range(0, len(samples.positions), chunk):
        check_stop()
        some = slice(at, at + chunk)
        positions = samples.positions[some]
        paths, violation = problem.at(positions)
        k, i = np.nonzero(violation == 0.0)
        yield Placements(
            positions[i],
            paths.yaw[k, i],
            paths.joints[:, k, i].transpose(1, 2, 0),
            SIGNS[k],
            paths.objective[k, i],
            samples.groups[some][i],
            samples.cells[some][i],
        )


def nothing(problem: ReducedProblem) -> Placements:
    """No placement."""
    return Placements(
        np.zeros((0, 3)),
        np.zeros(0),
        np.zeros((0, len(problem.positions), 6)),
        np.zeros((0, 3), dtype=np.int64),
        np.zeros(0),
        np.zeros(0, dtype=np.int64),
        np.zeros((0, 3)),
    )


def moved(
    problem: FollowedProblem, placements: Placements, positions: Floats, cells: Floats
) -> tuple[Placements, Ints]:
    """The placements at other positions (N, 3) in the same postures.

    Returns:
        Those that are usable there, and their numbers.
    """
    paths, violation = problem.at(positions, placements.signs)
    good = np.flatnonzero(violation[0] == 0.0)
    found = Placements(
        positions[good],
        paths.yaw[0, good],
        paths.joints[:, 0, good].transpose(1, 2, 0),
        placements.signs[good],
        paths.objective[0, good],
        placements.groups[good],
        cells[good],
    )
    return found, good


def well_conditioned(problem: ReducedProblem, placements: Placements) -> Bools:
    """(N,) False where a path misses the conditioning that is asked for."""
    if problem.arm.min_conditioning is None or not len(placements):
        return np.ones(len(placements), dtype=np.bool_)
    return conditioning_shortfall(problem, placements.joints.transpose(2, 0, 1)) <= 0.0


SIGNS: Ints = np.array(ALL_SIGNS, dtype=np.int64)
