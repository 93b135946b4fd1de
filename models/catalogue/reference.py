"""The reference posture q* of a robot when a request names none."""

from __future__ import annotations

from itertools import product

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.kinematics import characteristic_length, conditioning
from duocell.models.robot.robot import Robot

SINGULAR = 0.02
"""Mid-range postures conditioned worse than this are not used as a reference."""

QUARTER_TURN = 0.5 * np.pi


def mid_range(lower: Floats, upper: Floats) -> Floats:
    """(n,) rad, middle of the limits; 0 for joints without two finite limits."""
    limited = np.isfinite(lower) & np.isfinite(upper)
    middle: Floats = np.zeros_like(lower)
    middle[limited] = 0.5 * (lower[limited] + upper[limited])
    return middle


def default_reference(robot: Robot, lower: Floats, upper: Floats) -> Floats:
    """(n,) rad, q* where none is asked for: the robot's own where the limits in force admit it, else mid-range.

    Args:
        robot: whose it is.
        lower: (n,) rad limits in force. upper: (n,) likewise.
    """
    inside = (robot.reference >= lower) & (robot.reference <= upper)
    return np.where(inside, robot.reference, mid_range(lower, upper))


def working_reference(robot: Robot) -> tuple[Floats, str]:
    """A reference posture that is no singularity, and why it was chosen.

    Mid-range where that is conditioned at least `SINGULAR`. Else as few joints as possible (never the first or the
    last) leave it, each by a quarter of its range and at most 90°, upwards or downwards; the fewest that bring the
    conditioning to half of what any such move brings it to, and of those the best conditioned. Ties: the first in the
    order of joints, upwards before downwards.

    Returns:
        reference (n,) rad and one sentence for ``Robot.reference_source``.
    """
    middle = mid_range(robot.lower, robot.upper)
    length = characteristic_length(robot)
    at_middle = float(conditioning(robot, np.eye(4), middle, length)[0])
    if at_middle >= SINGULAR:
        return middle, "mid-range"
    step = np.minimum(0.25 * (robot.upper - robot.lower), QUARTER_TURN)  # 90° for joints without end
    moves = np.array([(0.0, *inner, 0.0) for inner in product((0.0, 1.0, -1.0), repeat=robot.dof - 2)])
    candidates = middle + moves * step
    scores = conditioning(robot, np.eye(4), candidates, length)
    moved = np.count_nonzero(moves, axis=1)
    good = scores >= 0.5 * scores.max()
    fewest = moved[good].min()
    eligible = np.flatnonzero(good & (moved == fewest))
    # Mirror images score alike up to rounding: the first within a hair of the best wins, on every machine.
    best = eligible[np.argmax(scores[eligible] >= scores[eligible].max() * (1.0 - 1e-6))]
    names = ", ".join(robot.joint_names[i] for i in np.flatnonzero(moves[best]))
    reason = (
        f"mid-range is singular (σmin/σmax {at_middle:.3f}); moved away from it by a quarter of the range, "
        f"at most 90°: {names} (σmin/σmax {scores[best]:.3f})"
    )
    return candidates[best], reason
