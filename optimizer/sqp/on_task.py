"""Arms brought onto the object's way: by their closed form where they have one, else by Newton's method.

Beside a singularity Newton's method arrives only from next to where it starts, which makes every step of a refinement
short there; a closed form does not mind.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.kinematics.branches import solve_signed
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.arm import TURN, Arm
from duocell.models.robot.posture import Signs
from duocell.optimizer.clearance.path_samples import follow

REACHED = 1e-9
"""m; what misses a pose by more does not take it."""


def brought_onto(
    arm: Arm, signs: Signs | None, base: Floats, flanges: Floats, near: Floats, guess: Floats
) -> tuple[Floats, Floats]:
    """Joints (K, n) rad that take flange poses, and (K,) m, what is missed; infinite where that is not known.

    Args:
        arm: the arm. signs: its posture, None if it has none. base: (4, 4) in the world.
        flanges: (K, 4, 4) in the world.
        near: (K, n) rad; a closed form's joints are taken on the turns nearest to these.
        guess: (K, n) rad, where Newton's method starts.
    """
    form = closed_form(arm.robot)
    if form is None or signs is None or not arm.avoid_singularities:
        joints, good = follow(arm.robot, base, flanges, guess, guess)
        return joints, np.where(good, 0.0, np.inf)
    targets = inverse(base) @ flanges
    found = solve_signed(form, targets[:, :3, :3], targets[None, :, :3, 3], np.array([signs]))
    joints = found.joints[:, 0, 0].T
    return joints + TURN * np.round((near - joints) / TURN), found.missing[0, 0]
