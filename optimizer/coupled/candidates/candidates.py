"""Candidates of one arm: its placements, cheapest first, tested only when somebody asks."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.optimizer.coupled.candidates.followed import FollowedProblem
from duocell.optimizer.coupled.candidates.placement_filter import FORGIVEN, PlacementFilter
from duocell.optimizer.coupled.candidates.placements import Placements

AT_ONCE = 128
"""Placements tested together."""


class ArmCandidates:
    """Placements of one arm with their violations by themselves."""

    def __init__(self, problem: FollowedProblem, placements: Placements, tests: PlacementFilter) -> None:
        """Nothing is tested yet.

        Args:
            problem: reduced problem of the arm. placements: cheapest first. tests: of the arm.
        """
        self.problem, self.placements, self.tests = problem, placements, tests
        self.violations: Floats = np.full(len(placements), np.nan)

    def __len__(self) -> int:
        return len(self.placements)

    def tested(self, rows: Ints) -> Floats:
        """(n,) m, violations of placements (n,); see `PlacementFilter.violations`."""
        new = np.unique(rows[np.isnan(self.violations[rows])])
        if len(new):
            self.violations[new] = self.tests.violations(self.placements.take(new))
        found: Floats = self.violations[rows]
        return found

    def usable(self, count: int) -> Ints:
        """Numbers of the ``count`` cheapest that violate nothing or little; fewer where there are no more."""
        found = np.zeros(0, dtype=np.int64)
        for at in range(0, len(self), AT_ONCE):
            if len(found) >= count:
                break
            rows = np.arange(at, min(at + AT_ONCE, len(self)))
            found = np.concatenate([found, rows[self.tested(rows) <= FORGIVEN]])
        return found[:count]
