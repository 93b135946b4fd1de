"""What joints 2, 3, 4 and 6 cost together at poses where the wrist is in its singularity or near it.

Each by itself they cost little or nothing there; the pitch of the hand, which they share, has to be somewhere
(`angles.pitch`). The cost of such a pose is at least the smallest over the parts of the pitch, and at least the sum of
what the joints cost by themselves; the larger counts, pose by pose, in the sum over the poses of a segment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.optimizer.certificate.bounds.angles.expansion import Enclosed
from duocell.optimizer.certificate.bounds.angles.joints import Kinematics
from duocell.optimizer.certificate.bounds.angles.pitch import has_free_pitch, pitch_cells
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.certificate.bounds.windings import nearest_windings

WIDE = 0.3
"""rad; where the wrist leaves pitch or joint 6 more than this open, they are bounded together."""
JOINTS = (1, 2, 3, 5)


@dataclass(frozen=True, eq=False, slots=True)
class Together:
    """Costs of joints 2, 3, 4 and 6 of N boxes and m poses.

    Attributes:
        cost: (N, m) least cost together where ``near``, else 0. near: (N, m) True at poses that are bounded so.
        each: (6, N, m) least cost of every joint by itself.
        singular: (N, m) True where the wrist is too near to its singularity all over the box.
    """

    cost: Floats
    near: Bools
    each: Floats
    singular: Bools

    def __getitem__(self, rows: Bools) -> Together:
        return Together(self.cost[rows], self.near[rows], self.each[:, rows], self.singular[rows])

    def sums(self, terms: Floats, rules: Rules) -> Floats:
        """(N, B) bound of a segment's cost, given bounds (6, N, m) of what each joint costs at each pose."""
        alone = np.sum(terms[list(JOINTS)], axis=0)
        cost = np.where(self.near, np.maximum(self.cost, alone), alone)
        sums: Floats = np.stack([np.sum(cost[:, segment], axis=1) for segment in rules.segments], axis=-1)
        return sums


def wrist_lost(kinematics: Kinematics, rules: Rules, found: Enclosed) -> Bools:
    """(N, m) True where the wrist is too near to its singularity all over a box."""
    bend = (found.angles.fifth - kinematics.wrist.zero) * (kinematics.wrist.sense * found.boxes.sign(2))
    least = rules.smallest_wrist
    return np.asarray(((bend.high < least) | (bend.low > np.pi - least)) & (least > 0.0))


def together_of(kinematics: Kinematics, rules: Rules, found: Enclosed, each: Floats, open_: Bools) -> Together | None:
    """Bound the four joints together.

    Args:
        kinematics: of the arm. rules: its limits and objective.
        found: enclosed joint values.
        each: (6, N, m) what every joint costs by itself, with what the poses count for.
        open_: (N,) True for boxes that are still worth it.

    Returns:
        None where it says nothing; costs are inf where a pose is not possible in a box.
    """
    if not has_free_pitch(kinematics):
        return None
    angles = found.angles
    wide = np.maximum(angles.turn.radius, angles.sixth.radius) > WIDE
    singular = wrist_lost(kinematics, rules, found)
    near = (wide | singular | ~found.slopes.rates.regular) & open_[:, None]
    cost, ruled = np.zeros(near.shape), np.zeros(near.shape, dtype=np.bool_)
    if np.any(near):
        box, pose = np.nonzero(near)
        cells = pitch_cells(kinematics, found.boxes, angles, (box, pose), rules.smallest_wrist)
        ruled[box, pose] = cells.singular
        sums = np.where(cells.alive, 0.0, np.inf)
        for k, i in enumerate(JOINTS):
            off = nearest_windings(cells.values[k], rules.lower[i], rules.upper[i], rules.reference[i])
            sums = sums + np.where(np.isinf(off), np.inf, rules.weights[i] * np.where(np.isinf(off), 0.0, off))
        least = np.min(sums, axis=1)
        counts = 1.0 if rules.counts is None else rules.counts[pose]
        cost[box, pose] = np.where(np.isinf(least), np.inf, counts * np.where(np.isinf(least), 0.0, least))
    return Together(cost, near, each, ruled)
