"""A way into the domain of the inverse kinematics, for starts that lie outside it.

Not in the source, which has no remedy for a start without an inverse-kinematics solution: there its E cannot be
evaluated at all. We take the reach rows as the violated constraints and minimise ``Σ max(0, g + margin)²`` over the
base position, with the same conjugate gradients, until every pose can be reached.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.baselines.conjugate_gradients import Descent, Point, fletcher_reeves
from duocell.optimizer.baselines.gradient import PostureFunction
from duocell.optimizer.baselines.penalty_rows import free_components

MARGIN = 0.02
"""m; how far inside the reach the phase aims."""


@dataclass(frozen=True, eq=False, slots=True)
class Approach:
    """End of the phase.

    Attributes:
        placement: (4,) where it ended; the yaw is that of the start.
        penalised: m², the sum that was minimised.
        worst: m, largest reach row; negative where every pose can be reached.
        descent: iterations and evaluations.
    """

    placement: Floats
    penalised: float
    worst: float
    descent: Descent[float]


def approach(function: PostureFunction, start: Floats) -> Approach:
    """Move the base from ``start`` (4,) until the posture of ``function`` reaches every pose, or no further."""
    components = free_components(function.problem.arm)
    components = components[components < 3]

    def evaluate(free: Floats, _: Point[float] | None) -> Point[float]:
        position = start[:3].copy()
        position[components] = free
        rows = function.reach_at(position)
        over = np.maximum(rows.values + MARGIN, 0.0)
        gradient = 2.0 * np.einsum("kj,kjc->c", over, rows.gradients)
        return Point(free, float(np.sum(over * over)), gradient[components], float(rows.values.max()))

    descent = fletcher_reeves(
        evaluate, evaluate(start[components], None), stop=lambda point: point.state <= -0.5 * MARGIN
    )
    placement = start.copy()
    placement[components] = descent.point.x
    return Approach(placement, descent.point.value, descent.point.state, descent)
