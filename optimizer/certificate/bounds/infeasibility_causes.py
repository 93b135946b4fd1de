"""What rules base positions out, counted by the share of the search it rules out."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.optimizer.certificate.bounds.box_bounds import LIMIT, LINEAR, PATH, REACH, SINGULAR, SUMS, BoxBounds
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.bounds.region import Region
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.results.proof import InfeasibilityCause

CONDITIONING = LINEAR + 1
_KINDS = {
    REACH: "out_of_reach",
    LIMIT: "joint_limit",
    PATH: "joint_step",
    SINGULAR: "singularity",
    LINEAR: "linear_limit",
    CONDITIONING: "conditioning",
}


class CauseShares:
    """Collects the causes of boxes without solution."""

    def __init__(self, problem: ReducedProblem, region: Region) -> None:
        self._size = np.maximum(region.high - region.low, 0.0)
        self._whole = max(int(np.sum(problem.postures)), 1)
        self._shares: dict[tuple[int, int], tuple[float, Floats]] = {}
        if region.empty:
            self._note(REACH, -1, 1.0, region.culprits.astype(np.float64))

    def add(self, boxes: Boxes, found: BoxBounds) -> None:
        """Count boxes."""
        shares = self._shares_of(boxes)
        for k, causes in enumerate(found.causes):
            for cause in np.unique(causes[causes > 0]):
                rows = causes == cause
                self._note(
                    int(cause),
                    -1 if k == SUMS else k - 1,
                    float(np.sum(shares[rows])),
                    shares[rows] @ found.poses[k, rows],
                )

    def add_poor(self, boxes: Boxes, poses: Bools) -> None:
        """Count boxes in which the smallest conditioning is not kept at some poses (N, m)."""
        shares = self._shares_of(boxes)
        if len(boxes):
            self._note(CONDITIONING, -1, float(np.sum(shares)), shares @ poses)

    def _shares_of(self, boxes: Boxes) -> Floats:
        """(N,) of what is searched."""
        parts = np.where(self._size > 0.0, 2.0 * boxes.half / np.maximum(self._size, 1e-300), 1.0)
        shares: Floats = np.prod(parts, axis=1) / self._whole
        return shares

    def _note(self, cause: int, joint: int, share: float, poses: Floats) -> None:
        before, poses_before = self._shares.get((cause, joint), (0.0, np.zeros_like(poses)))
        self._shares[cause, joint] = before + share, poses_before + poses

    def causes(self) -> tuple[InfeasibilityCause, ...]:
        """All causes, largest share first."""
        found = [
            InfeasibilityCause(_KINDS[cause], None if joint < 0 else joint, min(share, 1.0), np.minimum(poses, 1.0))
            for (cause, joint), (share, poses) in self._shares.items()
        ]
        return tuple(sorted(found, key=lambda cause: -cause.share))
