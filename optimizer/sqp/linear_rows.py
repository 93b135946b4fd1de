"""Linear rows around a layout, and their collector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.optimizer.sqp.manifold import Directions, Unknowns
from duocell.optimizer.sqp.samples import Samples


@dataclass(frozen=True, eq=False, slots=True)
class LinearRows:
    """K rows ``values + gradients · step >= required``.

    Attributes:
        gradients: (K, C). values: (K,) m or rad. required: (K,).
        reach: (K,) what a row loses per metre beyond the end of an arm's reach; 0 for rows of anything else.
    """

    gradients: Floats
    values: Floats
    required: Floats
    reach: Floats

    @property
    def violation(self) -> float:
        """The largest shortfall; <= 0 if every row holds."""
        return float(np.max(self.required - self.values, initial=-np.inf))

    def nearer(self, beyond: float) -> LinearRows:
        """Rows that ask for ``beyond`` m more of what is left of every arm's reach."""
        return replace(self, required=self.required + beyond * self.reach)


class RowCollector:
    """Collects rows of the samples of a path."""

    def __init__(self, unknowns: Unknowns, samples: Samples, along: Sequence[Directions]) -> None:
        """Start empty.

        Args:
            unknowns: of the cell. samples: of the path. along: per arm, its directions at the samples.
        """
        self.unknowns, self.samples, self.along = unknowns, samples, along
        self._gradients: list[Floats] = []
        self._values: list[Floats] = []
        self._required: list[Floats] = []
        self._reach: list[Floats] = []

    def rows(self) -> LinearRows:
        """What was collected."""
        nothing = np.zeros(0)
        return LinearRows(
            np.concatenate([np.zeros((0, self.unknowns.count)), *self._gradients]),
            np.concatenate([nothing, *self._values]),
            np.concatenate([nothing, *self._required]),
            np.concatenate([nothing, *self._reach]),
        )

    def add(self, gradients: Floats, values: Floats, required: Floats, reach: bool = False) -> None:
        """Rows (k, C) as they are; ``reach``: they tell how far the end of an arm's reach is."""
        self._gradients.append(gradients)
        self._values.append(values)
        self._required.append(required)
        self._reach.append(float(reach) * np.linalg.norm(gradients, axis=1))

    def add_at(
        self,
        at: Ints,
        by_base: Floats,
        by_joints: Sequence[Floats],
        values: Floats,
        required: Floats,
        reach: bool = False,
    ) -> None:
        """Rows of samples (k,) from the derivatives by bases (k, 4A) and, per arm, by joints (k, n)."""
        rows = np.zeros((len(at), self.unknowns.count))
        rows[:, : by_base.shape[1]] = by_base
        for a, slopes in enumerate(by_joints):
            if np.any(slopes):
                rows += self.through(a, at, slopes)
        self.add(rows, values, required, reach)

    def through(self, arm: int, at: Ints, slopes: Floats) -> Floats:
        """(k, C) derivatives by the unknowns, from those by the joints (k, n) of one arm at samples (k,).

        Between two poses the self-motion of a redundant arm is taken for what lies between theirs.
        """
        rows = np.zeros((len(at), self.unknowns.count))
        tangents, nullspace = self.along[arm], self.unknowns.nullspace[arm]
        rows[:, self.unknowns.base(arm)] = np.einsum("kn,knb->kb", slopes, tangents.by_base[at])
        if nullspace:
            pulled = np.einsum("kn,knd->kd", slopes, tangents.by_nullspace[at])
            step, fraction = self.samples.step[at], self.samples.fraction[at]
            for pose, share in ((step, 1.0 - fraction), (step + 1, fraction)):
                places = self.unknowns.first_nullspace[arm] + pose[:, None] * nullspace + np.arange(nullspace)
                rows[np.arange(len(at))[:, None], places] += share[:, None] * pulled
        return rows
