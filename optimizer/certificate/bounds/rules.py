"""What a path has to keep and what it costs: the numbers of an arm that its geometry does not know."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.segments import joined
from duocell.models.robot.arm import SINGULAR_WRIST, TURN
from duocell.optimizer.certificate.bounds.angles.joints import SLACK
from duocell.optimizer.certificate.bounds.yaw import Shifts
from duocell.optimizer.reduction.reduced import ReducedProblem

MISSED = KEPT + SLACK
"""rad by which limits and steps may be missed: what counts as kept must not be excluded, or a layout that passes every
check would be proved impossible."""
LEAST_WRIST = 1e-4
"""rad; of a wrist that keeps less from its singularity nothing is told (`angles.pitch` takes 1e-5 off)."""


@dataclass(frozen=True, eq=False, slots=True)
class Rules:
    """Limits (with what may be missed of them, and the slack of all enclosures) and objective of one arm.

    Attributes:
        lower: (6,) rad, -inf for joints without two limits. upper: (6,) rad, likewise inf.
        reference: (6,) rad, q*. weights: (6,) w.
        max_step: rad, largest step of a joint from pose to pose.
        shifts: what yaw and turns of 2π allow joint 1.
        segments: the poses of each segment. joined: (m - 1,) True where the next pose is one of the same segment.
        counts: (m,) what the poses count for in the objective; None for 1.
        smallest_wrist: rad, distance that the wrist keeps from its singularity; 0 where singularities are allowed.
        stepped: (6,) False for joints whose steps say nothing.
    """

    lower: Floats
    upper: Floats
    reference: Floats
    weights: Floats
    max_step: float
    shifts: Shifts
    segments: tuple[slice, ...]
    joined: Bools
    counts: Floats | None
    smallest_wrist: float = 0.0
    stepped: Bools = field(default_factory=lambda: np.ones(6, dtype=np.bool_))

    def share(self, segment: slice) -> Floats | None:
        """What the poses of a segment count for."""
        return None if self.counts is None else self.counts[segment]

    @staticmethod
    def of(problem: ReducedProblem) -> Rules:
        """The rules of a reduced problem."""
        arm, yaw, sigma = problem.arm, problem.arm.base.yaw, problem.sigma
        limited = np.isfinite(arm.lower) & np.isfinite(arm.upper)
        free = arm.base.yaw_free or yaw.width + 2.0 * MISSED >= TURN
        start = min(-sigma * yaw.low, -sigma * yaw.high) - MISSED
        return Rules(
            lower=np.where(limited, arm.lower - MISSED, -np.inf),
            upper=np.where(limited, arm.upper + MISSED, np.inf),
            reference=arm.reference,
            weights=arm.weights,
            max_step=problem.max_step + MISSED,
            stepped=np.array([True] * 5 + [not problem.last_open]),
            shifts=Shifts(start, yaw.width + 2.0 * MISSED, free),
            segments=problem.segments,
            joined=joined(problem.starts, len(problem.positions)),
            counts=problem.weights,
            smallest_wrist=_smallest_wrist(problem),
        )


def _smallest_wrist(problem: ReducedProblem) -> float:
    """What the wrist of this arm keeps where that of the arm that is asked about keeps what it has to."""
    left = SINGULAR_WRIST - KEPT - SLACK - problem.apart.fifth
    return left if problem.arm.avoid_singularities and left >= LEAST_WRIST else 0.0
