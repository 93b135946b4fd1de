"""Where between two poses an arm comes nearest to a singular set, or misses the object's way most.

The check of a way tells a place at which a margin is missed, found by halving a step. What is asked for at one place is
soon missed beside it: where the margin's dip may move along the step at no cost, fixed places chase it by halves. So a
dip is looked for anew at every layout. The margin at its bottom changes with the layout as at a place that does not
move, because it does not change along the step there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.singular_margins import margin_terms
from duocell.models.kinematics.closed_form import closed_form
from duocell.optimizer.clearance.path_samples import flanges_at
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.on_task import REACHED, brought_onto
from duocell.optimizer.verification.scene import Scene

PLACES, NEARER, ZOOMS = 64, 8, 3
"""Places of a step that are looked at, how many on either side of a dip, and how often these are drawn together."""
NEAR = 1.0 / 16.0
"""Share of a step by which a dip moves at most during a descent."""
MISSED = 1.0
"""What a metre beyond reach counts for beside the terms of `margin_terms`."""


def followed_dips(scene: Scene, points: Sequence[ArmSolution]) -> list[tuple[int, float]]:
    """Where the dips that a scene knows are at a layout, as (pose before, fraction)."""
    return [
        (step, _bottom(scene, index, points[index], step, fraction, NEAR)[0]) for index, step, fraction in scene.dips
    ]


def dips(scene: Scene, index: int, point: ArmSolution, step: int) -> list[float]:
    """Fractions of a step at which an arm violates its margins most, one for each stretch on which it violates any.

    Args:
        scene: the cell. index: of the arm. point: its base and joints at the poses. step: index of the pose before.

    Returns:
        The fractions; nothing for an arm without a closed form, or where nothing is violated.
    """
    if closed_form(scene.cell.arms[index].robot) is None or point.signs is None:
        return []
    every = (np.arange(PLACES) + 0.5) / PLACES
    margin = _least_margin(scene, index, point, step, every)
    padded = np.concatenate([[np.inf], margin, [np.inf]])
    lowest = (margin <= padded[:-2]) & (margin < padded[2:])
    found = [_bottom(scene, index, point, step, float(fraction), 1.0 / PLACES) for fraction in every[lowest]]
    return [fraction for fraction, least in found if least < 0.0]


def _bottom(
    scene: Scene, index: int, point: ArmSolution, step: int, fraction: float, width: float
) -> tuple[float, float]:
    """The bottom of a dip within so much of a fraction of a step: its fraction, and the margin there."""
    least = np.inf
    for _ in range(ZOOMS):
        around = fraction + width * np.arange(-NEARER, NEARER + 1) / NEARER
        around = around[(around > 0.0) & (around < 1.0)]
        margin = _least_margin(scene, index, point, step, around)
        fraction, least = float(around[np.argmin(margin)]), float(np.min(margin))
        width /= NEARER
    return fraction, least


def _least_margin(scene: Scene, index: int, point: ArmSolution, step: int, fractions: Floats) -> Floats:
    """(K,) the least margin term at fractions (K,) of a step; below zero where a margin is missed or the way is."""
    arm = scene.cell.arms[index]
    steps = np.full(len(fractions), step)
    flanges = flanges_at(scene.cell, arm, scene.path.at(steps, fractions), steps, fractions, point.free)
    share = fractions[:, None]
    near = (1.0 - share) * point.joints[step] + share * point.joints[step + 1]
    base = arm.base_in_world(point.position, point.yaw)
    joints, missing = brought_onto(arm, point.signs, base, flanges, near, near)
    margin: Floats = np.where(missing < REACHED, np.min(margin_terms(arm, joints), axis=-1), -MISSED * missing)
    return margin
