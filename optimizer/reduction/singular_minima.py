"""Singular minima of the cost: base positions about which a spread of points says nothing.

Where a pose is taken with a straight wrist (axes 4 and 6 in line), these joints may share their turn as they like;
close by, the direction in which the base is off decides it. So about such a place the cost of that pose takes a whole
range of values, and the optimum may be at the bottom of a minimum that is millimetres wide. The places are few and
known in closed form, so all of them are looked at.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.kinematics.straight_wrist import can_be_straight, straight_wrists
from duocell.models.robot.arm import TURN, Arm
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed

LEVELS = 12
"""Heights looked at where the height of the base is free."""
CLOSER, KEPT, ROUNDS = 3, 3, 3
"""Times as close as they are looked at again about the best of these many, so many times."""
COARSE, SLACK = 1.5, 1.03
"""What a place may seem to cost relative to what is known, where heights are only sampled: at first, and at last."""
FEW = 5
"""Poses whose cost is looked at first."""
SINGLE = 1e-9
"""rad; rounding of joint values that closed forms give."""
VERTICAL = 1e-9
"""How far from the vertical the first axis may be (its cosine): else no height is known."""
AROUND, RADIUS = 12, 2e-3
"""Points on a small circle about a place, and its radius (m); larger about the nearest point of a box beside it."""
NEAR = 1.5
"""Spacings."""
MOST = 32
"""Places that circles are drawn about."""


@dataclass(frozen=True, eq=False, slots=True)
class Places:
    """Base positions in postures.

    Attributes:
        positions: (K, 3) m. signs: (K, 3). pose: (K,) index of the pose that is taken with a straight wrist.
    """

    positions: Floats
    signs: Ints
    pose: Ints

    def only(self, which: Ints) -> Places:
        """Some of them."""
        return Places(self.positions[which], self.signs[which], self.pose[which])

    def joined(self, other: Places) -> Places:
        """These and others."""
        return Places(
            np.concatenate([self.positions, other.positions]),
            np.concatenate([self.signs, other.signs]),
            np.concatenate([self.pose, other.pose]),
        )


def singular_minima(problem: ReducedProblem, box: Floats, spacing: Floats, most: float) -> tuple[Floats, Ints]:
    """Places where the cost may fall below what is known in a singular minimum.

    Args:
        problem: the arm and the task.
        box: (3, 2) m, where bases may stand.
        spacing: (3,) m, between the bases that were looked at: a minimum that is outside, but nearer than this, may
            reach into the box unseen.
        most: cost that is known to be possible; infinite if none is.

    Returns:
        positions (K, AROUND, 3) m, circles about the places, and their signs (K, 3).
    """
    margin = np.where(box[:, 1] > box[:, 0], NEAR * spacing, 0.0)
    margin[2] = 0.0  # heights are those of the box
    places, least = _best_places(problem, box, margin, most)
    chosen = np.argsort(least, kind="stable")[:MOST]
    chosen = chosen[np.isfinite(least[chosen])]
    angle = TURN * np.arange(AROUND) / AROUND
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(AROUND)], axis=-1)
    inside = np.clip(places.positions[chosen], box[:, 0], box[:, 1])
    away = np.maximum(np.linalg.norm(inside - places.positions[chosen], axis=1), RADIUS)
    around = np.clip(inside[:, None, :] + away[:, None, None] * circle, box[:, 0], box[:, 1])
    return around, places.signs[chosen]


def _best_places(problem: ReducedProblem, box: Floats, margin: Floats, most: float) -> tuple[Places, Floats]:
    """Places and their least costs; where z is free, at heights that are closer where the cost is low."""
    if box[2, 1] == box[2, 0]:
        places = straight_places(problem, box, margin, box[2, :1])
        return places, least_costs(problem, places, most)
    heights, spacing = np.linspace(box[2, 0], box[2, 1], LEVELS), (box[2, 1] - box[2, 0]) / (LEVELS - 1)
    places = straight_places(problem, box, margin, heights)
    least = least_costs(problem, places, COARSE * most)
    for _ in range(ROUNDS):
        spacing /= CLOSER
        best = places.positions[np.argsort(least, kind="stable")[:KEPT], 2]
        heights = np.unique(np.clip(best[:, None] + spacing * np.array([-2.0, -1.0, 1.0, 2.0]), *box[2]))
        closer = straight_places(problem, box, margin, heights)
        places = places.joined(closer)
        least = np.concatenate([least, least_costs(problem, closer, COARSE * most)])
    return places, np.where(least < SLACK * most, least, np.inf)


def straight_places(problem: ReducedProblem, box: Floats, margin: Floats, heights: Floats) -> Places:
    """Places at some heights (L,) with a straight wrist at some pose, in both wrist signs.

    They are in the box or no farther outside than ``margin`` (3,) m.
    """
    arm, form = problem.arm, problem.form
    upward = arm.mount @ form.axes[0]
    if not can_be_straight(form) or abs(upward[2]) < 1.0 - VERTICAL:
        return Places(np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), np.empty(0, dtype=np.int64))
    # W from the origin on axis 1, in axes of the mount, if the base stood at the world's origin
    seen = problem.positions @ arm.mount + problem.rotations @ form.wrist_in_flange - form.origin
    tool_axis = problem.rotations @ (form.home_rotation.T @ form.axes[5])
    straight = straight_wrists(form, tool_axis, (seen @ form.axes[0])[:, None] - upward[2] * heights)
    positions = (seen[:, None, :] - straight.wrist) @ arm.mount.T  # (8, m, L, 3)
    positions[..., 2] = heights
    inside = np.all((positions >= box[:, 0] - margin) & (positions <= box[:, 1] + margin), axis=-1)
    inside &= (straight.shoulder * straight.elbow != 0) & _within_limits(arm, straight.joints)
    pose = np.broadcast_to(np.arange(len(seen))[:, None], inside.shape)[inside]
    wrists = np.repeat([1, -1], len(pose))
    signs = np.stack([np.tile(straight.shoulder[inside], 2), np.tile(straight.elbow[inside], 2), wrists], axis=-1)
    admitted = np.array([arm.posture.admits((s[0], s[1], s[2])) for s in signs.tolist()], dtype=bool)
    return Places(np.tile(positions[inside], (2, 1))[admitted], signs[admitted], np.tile(pose, 2)[admitted])


def _within_limits(arm: Arm, joints: Floats) -> Bools:
    """(...) True where joints 2, 3 and 5 (3, ...) have a turn inside their limits."""
    within = np.ones(joints.shape[1:], dtype=bool)
    for values, i in zip(joints, (1, 2, 4), strict=True):
        if np.isfinite(arm.upper[i] - arm.lower[i]):
            within &= np.mod(values - arm.lower[i] + SINGLE, TURN) <= arm.upper[i] - arm.lower[i] + 2.0 * SINGLE
    return within


def least_costs(problem: ReducedProblem, places: Places, most: float = np.inf) -> Floats:
    """(K,) what a path from each place costs at least; infinite out of reach, and where that is more than ``most``.

    All joints but the first count as in their best turn pose by pose, joints 4 and 6 not at all where the wrist is
    straight. Some of the poses are looked at first: they alone may cost too much.
    """
    least = np.full(len(places.pose), np.inf)
    few = np.unique(np.linspace(0, len(problem.positions) - 1, FEW).round().astype(int))
    promising = np.flatnonzero(_least(problem, places, few) < most)
    if len(promising):
        least[promising] = _least(problem, places.only(promising), np.arange(len(problem.positions)))
    return np.where(least < most, least, np.inf)


def _least(problem: ReducedProblem, places: Places, poses: Ints) -> Floats:
    """(K,) the least cost of some of the poses."""
    arm, some = problem.arm, problem.only(poses)
    paths = evaluate_signed(some, places.positions, places.signs)
    error = paths.joints[:, 0] - arm.reference[:, None, None]  # (6, K, m)
    error[1:] -= TURN * np.round(error[1:] / TURN)
    error[3::2, places.pose[:, None] == poses] = 0.0
    weights = np.ones(len(poses)) if problem.weights is None else problem.weights[poses]
    cost = np.einsum("i,ikm,ikm->k", arm.weights, error, weights * error, optimize=False)
    return np.where(paths.missing[0] > 0.0, np.inf, cost)
