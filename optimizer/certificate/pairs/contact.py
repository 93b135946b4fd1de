"""Arm against arm over pairs of boxes: capsules of both at one pose, moved as far as the boxes allow.

Two points X and Y of the nearest two capsules move by at most their balls; to first order ``X - Y`` moves by
``G_X d_1 - G_Y d_2``, whose distance from 0 is convex and largest at a corner of the two boxes. Along the segment of a
capsule places and slopes are linear, balls and remainders convex: what holds at the ends, interpolated, holds between.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE
from duocell.optimizer.certificate.exclusion.gap import segment_gaps
from duocell.optimizer.certificate.exclusion.motion import Motion
from duocell.optimizer.certificate.exclusion.points import deepest
from duocell.optimizer.certificate.pairs.store import PairStore

DEEPEST = 10
"""Pairs of capsules looked at for a pair of boxes, those deepest in each other at the centres."""
AT_ONCE = 400_000
"""Pairs of capsules, times poses, times pairs of boxes, looked at together."""


@dataclass(frozen=True, eq=False, slots=True)
class Contact:
    """Two arms that must keep apart.

    Attributes:
        first: of the one arm. second: of the other.
        one: (c,) capsules of the first. other: (c,) of the second that they must keep away from.
        allowance: (c,) m, radii and required distance together.
        half: (c,) m, half the lengths of both capsules together.
    """

    first: PairStore
    second: PairStore
    one: Ints
    other: Ints
    allowance: Floats
    half: Floats

    @staticmethod
    def of(first: PairStore, second: PairStore, model: CollisionModel | None, required: Floats) -> Contact:
        """All pairs of capsules of two arms that a distance is asked for between."""
        capsules = [store.tree.excluder.bodies.capsules for store in (first, second)]
        asked: dict[tuple[int, int], float] = {}
        if model is not None:
            for pair in np.flatnonzero([kind is PairClass.ARM_ARM for kind in model.bodies.kinds]):
                i, j = int(model.bodies.first[pair]), int(model.bodies.second[pair])
                asked[i, j] = asked[j, i] = float(required[pair])
        rows = [
            (i, j, asked[int(a), int(b)])
            for i, a in enumerate(capsules[0].body)
            for j, b in enumerate(capsules[1].body)
            if (int(a), int(b)) in asked
        ]
        one, other = (np.array([row[k] for row in rows], dtype=np.int64) for k in (0, 1))
        radii = capsules[0].radius[one] + capsules[1].radius[other]
        lengths = [np.linalg.norm(c.ends[:, 1] - c.ends[:, 0], axis=1) for c in capsules]
        half = 0.5 * (lengths[0][one] + lengths[1][other])
        return Contact(first, second, one, other, radii + np.array([row[2] for row in rows]), half)

    def slack(self, first: Ints, second: Ints, level: float = 0.0) -> Floats:
        """(P,) m; wherever in pairs of boxes both bases stand, no more than this is kept beyond what is required.

        Infinite where nothing is known.

        Args:
            first: (P,) numbers of boxes of the first arm. second: of the second. level: m, slacks of interest.
        """
        found: Floats = np.full(len(first), np.inf)
        if not len(self.one) or not len(first):
            return found
        slots = self.first.places(first), self.second.places(second)
        step = max(AT_ONCE // (len(self.one) * len(self.first.poses)), 1)
        for at in range(0, len(first), step):
            some = slice(at, at + step)
            found[some] = self._slack(slots[0][some], slots[1][some], level)
        return found

    def _slack(self, first: Ints, second: Ints, level: float) -> Floats:
        slack = np.full(len(first), np.inf)
        middles = [store.ends.mean(axis=3)[slots] for store, slots in ((self.first, first), (self.second, second))]
        apart = np.linalg.norm(middles[0][:, :, self.one] - middles[1][:, :, self.other], axis=-1)
        pair, pose, which = np.nonzero(apart - self.half - self.allowance < level - TOLERANCE)
        one, other = self.one[which], self.other[which]
        segments = self.first.ends[first[pair], pose, one], self.second.ends[second[pair], pose, other]
        distance, s, t = segment_gaps(*segments)
        here = distance - self.allowance[which]
        near = np.flatnonzero(here < level - TOLERANCE)
        if not len(near):
            return slack
        near = near[deepest(pair[near], here[near], DEEPEST)]
        pair, pose, here = pair[near], pose[near], here[near]
        moved = _moved(self.first, first[pair], pose, one[near], s[near])
        against = _moved(self.second, second[pair], pose, other[near], t[near])
        most = here + moved.ball + against.ball
        rest = moved.rest + against.rest
        some = np.flatnonzero(here + rest < np.minimum(most, level))
        if len(some):
            corners = _corners(moved[some], against[some]) - self.allowance[which[near[some]]] + rest[some]
            most[some] = np.fmin(most[some], corners)
        np.fmin.at(slack, pair, most)
        return slack


@dataclass(frozen=True, eq=False, slots=True)
class _Moved:
    """Points on capsules [m]: place (q, 3), ball (q,), step (q, 3, K) as slopes times half sides, rest (q,)."""

    place: Floats
    ball: Floats
    step: Floats
    rest: Floats

    def __getitem__(self, rows: Ints | Bools) -> _Moved:
        return _Moved(self.place[rows], self.ball[rows], self.step[rows], self.rest[rows])


def _moved(store: PairStore, slots: Ints, pose: Ints, capsule: Ints, share: Floats) -> _Moved:
    """Points at shares (q,) of the way along capsules (q,) in boxes (q,) at poses (q,)."""
    motion = store.motion
    assert motion is not None
    link, segment = store.tree.excluder.bodies.capsules.link[capsule], store.ends[slots, pose, capsule]
    (ball, slope, rest), (far_ball, far_slope, far_rest) = (
        _end(motion, slots, pose, segment[:, k], link) for k in (0, 1)
    )
    back, turn = 1.0 - share, share[:, None, None]
    place = back[:, None] * segment[:, 0] + share[:, None] * segment[:, 1]
    step = ((1.0 - turn) * slope + turn * far_slope) * motion.half[slots][:, None]
    with np.errstate(invalid="ignore"):  # a share of 0 of what is not known: not known
        return _Moved(place, back * ball + share * far_ball, step, back * rest + share * far_rest)


def _end(motion: Motion, slots: Ints, pose: Ints, points: Floats, link: Ints) -> tuple[Floats, Floats, Floats]:
    """Ball, slopes and remainder of points (q, 3); of the base link, which goes where the box goes."""
    ball, gradient, rest = motion.linear(slots, pose, points, link)
    base = link == 0
    ball = np.where(base, motion.shift[slots], ball)
    gradient = np.where(base[:, None, None], motion.unit, gradient)
    return ball, gradient, np.where(base, 0.0, rest)


def _corners(moved: _Moved, against: _Moved) -> Floats:
    """(q,) m, the largest distance of two points over the corners of their boxes."""
    apart = (moved.place - against.place)[:, None]
    steps = []
    for step in (moved.step, against.step):
        signs = np.array(list(product((-1.0, 1.0), repeat=step.shape[2])))
        steps.append(np.einsum("qaK,vK->qva", step, signs))
    between = apart[:, :, None] + steps[0][:, :, None] - steps[1][:, None]
    return np.asarray(np.max(np.linalg.norm(between, axis=-1), axis=(1, 2)))
