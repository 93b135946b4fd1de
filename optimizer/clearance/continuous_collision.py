"""Halving the intervals of a path until every pair of bodies is settled.

A pair that is d and d' apart at the ends of an interval, and moves against each other by at most L on it, stays
``(d + d' - L) / 2`` apart. L comes from joint steps and lever arms (`duocell.optimizer.clearance.motion`). A joint's
way is bounded from its chord and from how far its middle sags, exactly for a parabola, with a tenth on top for what is
no parabola.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances
from duocell.models.collision.collision import CollisionModel, Configurations
from duocell.optimizer.clearance.motion import Motion
from duocell.optimizer.clearance.path_samples import ObjectPath, flanges_at, follow

SAFETY = 1.1
"""On the parabola's bound of the joints' way."""
LONGEST_STEP = 0.3
"""rad; on longer intervals a joint's way need not look like a parabola yet."""
LIMITS = KEPT
"""rad; slack of joint limits."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """Where refining stops: at intervals on which the object moves less than ``length`` m and turns less than
    ``angle`` rad, or after ``most_samples`` configurations.
    """

    length: float = 1e-3
    angle: float = radians(0.5)
    most_samples: int = 4000


class ContinuousCollisionCheck:
    """Samples of a path and the intervals between them that are still open.

    Call `halve` until `left` is empty; then ``least`` (P,) [m] bounds every pair's distance on the whole path from
    below and ``breaks`` says where an arm could not follow (name, pose before, fraction of the way to the next).

    Samples (N) have a place on the path (``step``, ``fraction``), joints, configurations, known distances ``gaps``
    (N, P) (lower bounds where ``exact`` is False, infinite where nobody asked) and levers. Intervals (I) join samples
    ``left`` and ``right``; ``open`` (I, P) are the pairs not settled there.
    """

    def __init__(
        self,
        cell: Cell,
        model: CollisionModel,
        clearances: Clearances,
        bases: Floats,
        joints: Sequence[Floats],
        resolution: Resolution,
    ) -> None:
        """Sample the poses."""
        self.cell, self.model, self.bases, self.resolution = cell, model, bases, resolution
        self.clearances = clearances
        self.required = np.array([clearances.required(kind) or 0.0 for kind in model.bodies.kinds]) - KEPT
        self.slack = _slack(model)
        self.motion = Motion(model)
        self.path = ObjectPath(cell.task.poses)
        count = len(cell.task)
        last = np.arange(count) == (count - 1 if cell.task.joined[-1:].any() else count)
        self.step: Ints = np.arange(count) - last
        self.fraction: Floats = last.astype(np.float64)
        self.joints = [np.array(q, dtype=np.float64) for q in joints]
        self.segments: Ints = cell.task.segment_of
        self.places = model.configure(bases, self.joints, cell.task.poses, self.segments)
        self.gaps: Floats = model.bounds(self.places)
        self.exact: Bools = np.tile(model.exact_bounds, (count, 1))
        self.levers = self.motion.levers(self.places)
        self.left: Ints = np.flatnonzero(cell.task.joined)  # from one segment to the next there is no way
        self.right: Ints = self.left + 1
        self.open: Bools = np.tile(self.places.counted, (len(self.left), 1))
        self.least: Floats = np.full(len(self.required), np.inf)
        self.breaks: list[tuple[str, int, float]] = []
        self.limits_certain = True

    # --- one round ----------------------------------------------------------------------------------------------------

    def halve(self) -> None:
        """Sample the middles of all intervals and keep the halves that are not settled."""
        if len(self.step) + len(self.left) > self.resolution.most_samples:
            self._give_up()
            return
        middle = self._sample_middles()
        travels = [  # at most, on either half
            0.5 * SAFETY * (np.abs(q[self.right] - q[self.left]) + 4.0 * np.abs(self._sag(q, middle)))
            for q in self.joints
        ]
        smooth = np.all([np.max(travel, axis=1) <= LONGEST_STEP for travel in travels], axis=0)
        start, end = np.concatenate([self.left, middle]), np.concatenate([middle, self.right])
        going, unsettled = self._settle(start, end, travels, middle, smooth)
        self.left, self.right, self.open = start[going], end[going], unsettled[going]

    def _sample_middles(self) -> Ints:
        """Add a sample in the middle of every interval; intervals that an arm cannot follow are dropped.

        Returns:
            (I,) numbers of the new samples.
        """
        step, fraction = self.step[self.left], self._middle()
        objects = self.path.at(step, fraction)
        followed, good = [], np.ones(len(step), dtype=np.bool_)
        for arm, base, q in zip(self.cell.arms, self.bases, self.joints, strict=True):
            flanges = flanges_at(self.cell, arm, objects, step, fraction)
            found, arrived = follow(arm.robot, base, flanges, q[self.left], q[self.right])
            followed.append(found)
            lost = good & ~arrived
            self.breaks += [(arm.name, int(step[i]), float(fraction[i])) for i in np.flatnonzero(lost)]
            good &= arrived
        self.left, self.right, self.open = self.left[good], self.right[good], self.open[good]
        first = len(self.step)
        self.joints = [np.concatenate([q, found[good]]) for q, found in zip(self.joints, followed, strict=True)]
        segments = self.segments[step[good]]
        places = self.model.configure(self.bases, [found[good] for found in followed], objects[good], segments)
        asked = np.any(self.open, axis=0)
        self.gaps = np.concatenate([self.gaps, self.model.bounds(places, asked)])
        self.exact = np.concatenate([self.exact, np.tile(self.model.exact_bounds, (len(places), 1))])
        self.levers = [np.concatenate(pair) for pair in zip(self.levers, self.motion.levers(places), strict=True)]
        self.places = Configurations(
            np.concatenate([self.places.frames, places.frames]),
            np.concatenate([self.places.ends, places.ends]),
            self.places.counted,
            np.concatenate([self.places.segments, segments]),
        )
        self.step = np.concatenate([self.step, step[good]])
        self.fraction = np.concatenate([self.fraction, fraction[good]])
        return np.arange(first, len(self.step))

    def _middle(self) -> Floats:
        """(I,) fractions halfway; the last pose counts as fraction 1 of the step before it, the others as 0."""
        return 0.5 * (self.fraction[self.left] + self._end())

    def _end(self) -> Floats:
        """(I,) fraction of each interval's right end, counted from the pose before its left end."""
        return np.where(self.step[self.right] > self.step[self.left], 1.0, self.fraction[self.right])

    def _sag(self, q: Floats, middle: Ints) -> Floats:
        """(I, n) rad, how far the middles lie off the chord."""
        sag: Floats = q[middle] - 0.5 * (q[self.left] + q[self.right])
        return sag

    def _settle(
        self, start: Ints, end: Ints, travels: list[Floats], middle: Ints, smooth: Bools
    ) -> tuple[Bools, Bools]:
        """Settle what can be settled on the halves of all intervals.

        Args:
            start: (2 I,) samples where the halves begin: all first halves, then all second ones. end: likewise.
            travels: per arm (I, n) rad, at most what each joint travels on either half.
            middle: (I,) samples in the middles.
            smooth: (I,) False where the joints' way need not look like a parabola yet.

        Returns:
            (2 I,) halves to go on with, (2 I, P) pairs that are open there.
        """
        share = 0.5 * (self._end() - self.fraction[self.left])
        step = self.step[self.left]
        shift = np.tile(share * np.linalg.norm(self.path.shifts[step], axis=1), 2)
        turn = np.tile(share * np.linalg.norm(self.path.turns[step], axis=1), 2)
        travels, smooth = [np.tile(travel, (2, 1)) for travel in travels], np.tile(smooth, 2)
        opened = np.tile(self.open, (2, 1))
        moved = self.motion.between(
            [x[start] for x in self.levers], [x[end] for x in self.levers], travels, shift, turn
        )
        last = (shift <= self.resolution.length) & (turn <= self.resolution.angle)
        unsettled = opened & ~self._kept(start, end, moved, smooth)
        self._measure(start, end, moved, unsettled, last)
        kept = self._kept(start, end, moved, smooth)
        near = np.minimum(self.gaps[start], self.gaps[end]) < self.required
        near &= np.where(self.gaps[start] < self.gaps[end], self.exact[start], self.exact[end])
        done = opened & (kept | near | last[:, None])
        low = 0.5 * (self.gaps[start] + self.gaps[end] - moved)
        low = np.where(smooth[:, None], low, -np.inf)
        self.least = np.minimum(self.least, np.min(np.where(done, low, np.inf), axis=0, initial=np.inf))
        unsettled = opened & ~done
        within = self._within_limits(start, end, middle, last)
        return np.any(unsettled, axis=1) | ~within, unsettled

    def _kept(self, start: Ints, end: Ints, moved: Floats, smooth: Bools) -> Bools:
        """(I, P) True where a pair surely keeps its distance on a half."""
        kept: Bools = (self.gaps[start] + self.gaps[end] - moved >= 2.0 * self.required) & smooth[:, None]
        return kept

    def _measure(self, start: Ints, end: Ints, moved: Floats, unsettled: Bools, last: Bools) -> None:
        """Ask for distances where a bound may be what keeps a pair from being settled."""
        short = 2.0 * self.required - (self.gaps[start] + self.gaps[end] - moved)
        worth = unsettled & ((short <= 2.0 * self.slack) | last[:, None])
        asked = np.zeros_like(self.exact)
        for sample in (start, end):
            i, pairs = np.nonzero(worth & ~self.exact[sample])
            asked[sample[i], pairs] = True  # a middle belongs to two halves
        k, pairs = np.nonzero(asked)
        self.gaps[k, pairs] = self.model.distances(self.places, k, pairs)
        self.exact |= asked

    def _within_limits(self, start: Ints, end: Ints, middle: Ints, last: Bools) -> Bools:
        """(I,) False for halves where a joint may leave its limits though it keeps them at the samples."""
        within: Bools = np.ones(len(start), dtype=np.bool_)
        for arm, q in zip(self.cell.arms, self.joints, strict=True):
            sag = np.tile(0.5 * np.abs(self._sag(q, middle)), (2, 1))  # a parabola's, of each half, is a quarter
            sag = arm.bounded_sizes(sag)
            bounded, upper, lower = arm.bounded(q), arm.bounded_upper + LIMITS, arm.bounded_lower - LIMITS
            high, low = np.maximum(bounded[start], bounded[end]), np.minimum(bounded[start], bounded[end])
            inside = (high <= upper) & (low >= lower)
            sure = (high + sag <= upper) & (low - sag >= lower)
            within &= np.all(sure | ~inside, axis=1)
        if np.any(last & ~within):
            self.limits_certain = False
        return within | last

    def _give_up(self) -> None:
        """Leave all intervals as they are."""
        self.least = np.where(np.any(self.open, axis=0), -np.inf, self.least)
        self.limits_certain = False
        self.left, self.right, self.open = self.left[:0], self.right[:0], self.open[:0]


def _slack(model: CollisionModel) -> Floats:
    """(P,) m, by how much a pair's bound may fall short: at most the thickness of what bounds its bodies."""
    b = model.bodies
    loose = np.where(b.rounded | b.flat, 0.0, b.radius)
    slack: Floats = loose[b.first] + loose[b.second]
    return slack
