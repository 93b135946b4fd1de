"""How far an arm keeps from the ends of its posture along a way: shoulder, elbow and wrist.

At these ends two postures meet. A way that touches one, however shortly, can be gone on in either posture, and joint
speeds have no bound there: no controller follows it. So along a way a small margin is kept. An elbow that is stretched
or folded but for 1 mrad lacks less than a thousandth of a millimetre of its reach: between the poses the margin costs
next to nothing. Where a way begins or ends, the arm need not go on: there it may stand at the end of its posture, and
its way keeps at least as far as it stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import posture_terms
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.nominal import singular_fifth
from duocell.models.robot.arm import SINGULAR_WRIST, Arm

SHOULDER, ELBOW = 1e-3, 1e-3
"""m that the wrist's point keeps in front of axis 1 (or behind it), and rad that the elbow keeps from being stretched
or folded, along a way. The wrist keeps `duocell.models.robot.arm.SINGULAR_WRIST`."""
MARGIN_FACTOR = 1.25
"""Programs ask for so much more, because they see a way at few places only."""
STILL = 1e-9
"""rad between consecutive poses in which an arm stands still."""


@dataclass(frozen=True, slots=True)
class Margins:
    """What is kept from each singular set: shoulder [m], elbow and wrist [rad]."""

    shoulder: float
    elbow: float
    wrist: float


def margins_along(arm: Arm, share: float = 1.0) -> Margins:
    """What an arm with a closed form keeps along a way, times ``share``."""
    return Margins(share * SHOULDER, share * ELBOW, share * SINGULAR_WRIST if arm.avoid_singularities else 0.0)


def margins_at_poses(arm: Arm) -> Margins:
    """What it keeps at poses from which no way begins."""
    return Margins(0.0, 0.0, SINGULAR_WRIST if arm.avoid_singularities else 0.0)


def keeps_margins(arm: Arm) -> bool:
    """True if an arm keeps a margin from any singular set."""
    return closed_form(arm.robot) is not None or (arm.avoid_singularities and singular_fifth(arm.robot) is not None)


def margin_terms(arm: Arm, joints: Floats) -> Floats:
    """Smooth functions of the place that are negative where an arm comes too near a singular set.

    The square of the distance in front of axis 1 and the cosines of elbow and wrist are smooth along a way, also where
    joints are not: what the former exceeds, and by what the latter keep off 1 and -1.

    Args:
        arm: an arm that `keeps_margins`.
        joints: (..., 6) rad.

    Returns:
        (..., 3) shoulder [m²], elbow stretched, elbow folded; (..., 5) with the wrist's two where that is to be kept;
        (..., 2) the wrist's alone for arms that are not quite as drawn.
    """
    margins, form, singular = margins_along(arm), closed_form(arm.robot), singular_fifth(arm.robot)
    terms, cosines = [], []
    if form is not None:
        front, _, _ = posture_terms(form, np.moveaxis(joints, -1, 0), np.sin, np.cos)
        terms.append(front**2 - (margins.shoulder - KEPT) ** 2)
        cosines.append((form.planar.elbow_angle + form.turns[2] * joints[..., 2], margins.elbow))
    if arm.avoid_singularities and singular is not None:
        cosines.append((joints[..., 4] - singular, margins.wrist))
    for angle, margin in cosines:
        cosine, most = np.cos(angle), np.cos(margin - KEPT)
        terms += [most - cosine, most + cosine]
    return np.stack(terms, axis=-1)


def violations_at_poses(arm: Arm, task: Task, joints: Floats) -> tuple[Bools, Floats]:
    """Which poses a way may not go through, and how much the ways from and to other poses may violate the margins.

    Args:
        arm: an arm that `keeps_margins`.
        task: the poses. joints: (m, 6) rad at them.

    Returns:
        (m,) True where a way goes through a pose that is too near a singular set; (m - 1, k) how far the terms of
        `margin_terms` may be below zero on each step, because a way begins or ends at a pose that is as near.
    """
    violation = np.maximum(-margin_terms(arm, joints), 0.0)
    ends = _ends(task, joints)
    allowed = np.where(ends[:, None], violation, 0.0)
    return np.any(violation > 0.0, axis=-1) & ~ends, np.maximum(allowed[:-1], allowed[1:])


def _ends(task: Task, joints: Floats) -> Bools:
    """(m,) True for poses at which a way begins or ends, and for those in which the arm stands still beside them."""
    joined = task.joined
    first_or_last = np.append(True, ~joined) | np.append(~joined, True)
    still = joined & (np.max(np.abs(np.diff(joints, axis=0)), axis=1, initial=0.0) < STILL)
    place = np.append(0, np.cumsum(~still))
    ends: Bools = np.isin(place, place[first_or_last])
    return ends
