"""Links of one arm against each other: only the joints between two links move them relative to each other.

With the link of the lower number held in place, joints i+1 to k of links i < k are turned one after the other, the one
nearest to link i first: each distance from an axis is made by joints that have not turned yet, so the point of link k
moves by at most ``Σ 2 ρ sin(min(Δ, π)/2)``. Joint 1 turns all links about the yaw axis, on which the capsules of the
base lie.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.certificate.exclusion.bodies import Capsules, SelfPair
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE
from duocell.optimizer.certificate.exclusion.gap import segment_gaps
from duocell.optimizer.certificate.exclusion.motion import Motion


def self_slack(motion: Motion, capsules: Capsules, ends: Floats, pairs: Sequence[SelfPair], level: float) -> Floats:
    """(N,) m; in all of a box some pair keeps no more than this beyond what is required; inf where nothing is known.

    Args:
        motion: over N boxes. capsules: of the arm. ends: (N, m, C, 2, 3) m at the centres of the boxes.
        pairs: to look at. level: m, slacks of interest.
    """
    slack = np.full(len(motion), np.inf)
    first, second = np.array([p.first for p in pairs]), np.array([p.second for p in pairs])
    required = np.array([p.required for p in pairs]) + capsules.radius[first] + capsules.radius[second]
    distance, _, share = segment_gaps(ends[:, :, first], ends[:, :, second])
    here = distance - required
    box, pose, which = np.nonzero(here < level - TOLERANCE)
    if not len(box):
        return slack
    one, other = capsules.link[first[which]], capsules.link[second[which]]
    t = share[box, pose, which][:, None]
    segment = ends[box, pose, second[which]]
    swing = motion.swings(box, pose, (1.0 - t) * segment[:, 0] + t * segment[:, 1])[2]
    joint = np.arange(6)
    between = (joint >= np.maximum(one, 1)[:, None]) & (joint < other[:, None])
    np.fmin.at(slack, box, here[box, pose, which] + np.sum(np.where(between, swing, 0.0), axis=1))
    return slack
