"""Lower bounds of the distances of all pairs of bodies in many configurations at once, exact where that is cheap."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.collision.collision_bodies import CellBodies
from duocell.models.geometry.bounding import ROUNDING, box_distances, box_gaps, exact_box_distances, segment_distances
from duocell.models.geometry.shapes import Box

_AT_ONCE = 200_000
"""Pairs times configurations bounded in one go."""


class PairBounds:
    """Bounds for the pairs of a cell, by the capsules, boxes and planes of their bodies.

    Attributes:
        exact: (P,) True where bounds are the distances, less `ROUNDING`: balls and capsules among themselves and over
            half-spaces, boxes over half-spaces.
    """

    def __init__(self, bodies: CellBodies) -> None:
        """Sort the pairs by what bounds them."""
        self.bodies = b = bodies
        flat, round_first, round_second = b.flat[b.second], b.rounded[b.first], b.rounded[b.second]
        self._planes = np.flatnonzero(flat)
        self._solid = np.flatnonzero(~flat)
        self._box_second = np.flatnonzero(~flat & round_first & ~round_second)
        self._box_first = np.flatnonzero(~flat & ~round_first & round_second)
        self._boxes = np.flatnonzero(~flat & ~round_first & ~round_second)
        is_box = np.array([isinstance(body.shape, Box) for body in b.bodies], dtype=np.bool_)
        self.exact: Bools = (round_first & (round_second | flat)) | (is_box[b.first] & flat)
        self._thin_first: Bools = round_first & is_box[b.second]
        self._thin_second: Bools = round_second & is_box[b.first]
        self._kinds: Ints = np.select([flat, round_first & round_second, round_first, round_second], [0, 1, 2, 3], 4)
        self._ball: Floats = b.radius + 0.5 * np.linalg.norm(b.ends[:, 1] - b.ends[:, 0], axis=-1)

    def up_to(self, frames: Floats, ends: Floats, wanted: Bools, enough: Floats) -> Floats:
        """Bounds of some pairs, for whom only distances up to ``enough`` (P,) [m] are of interest.

        Arguments otherwise and result as for a call; where balls about bodies are farther from others than that, a
        rougher bound beyond it is given, which costs a fraction.
        """
        result: Floats = np.full((len(frames), len(wanted)), np.inf)
        some = np.flatnonzero(wanted)
        step = max(1, _AT_ONCE // max(1, len(some)))
        for start in range(0, len(frames), step):
            part = slice(start, start + step)
            gaps = self._between_balls(frames[part], ends[part], some)
            k, column = np.nonzero(gaps <= enough[some])
            gaps[k, column] = self.of_pairs(frames[part], ends[part], k, some[column])
            result[part, some] = gaps
        return result

    def _between_balls(self, frames: Floats, ends: Floats, pairs: Ints) -> Floats:
        """(K, q) m, bounds for pairs (q,) by balls about the capsules, of first bodies also beside the second's box."""
        b, (i, j) = self.bodies, (self.bodies.first[pairs], self.bodies.second[pairs])
        middles = 0.5 * (ends[:, :, 0] + ends[:, :, 1])
        away = middles[:, i] - middles[:, j]
        gaps: Floats = np.sqrt(np.einsum("kqa,kqa->kq", away, away)) - (self._ball[i] + self._ball[j])
        flat = np.flatnonzero(b.flat[j])
        if len(flat):
            plane = frames[:, b.frames[j[flat]]] @ b.box_poses[j[flat]]
            heights = np.einsum("kqa,kqa->kq", middles[:, i[flat]] - plane[..., :3, 3], plane[..., :3, 2])
            gaps[:, flat] = heights - self._ball[i[flat]]
        for boxed in np.unique(j[~b.flat[j] & ~b.rounded[j]]).tolist():
            those = np.flatnonzero(j == boxed)
            box = frames[:, b.frames[boxed]] @ b.box_poses[boxed]
            beyond = np.abs((middles[:, i[those]] - box[:, None, :3, 3]) @ box[:, :3, :3]) - b.half[boxed]
            np.maximum(beyond, 0.0, out=beyond)
            outside = np.sqrt(np.einsum("kqa,kqa->kq", beyond, beyond))
            gaps[:, those] = np.maximum(gaps[:, those], outside - self._ball[i[those]])
        return gaps - ROUNDING

    def of_pairs(self, frames: Floats, ends: Floats, k: Ints, pairs: Ints) -> Floats:
        """Bounds of single pairs, the same as those of a call.

        Args:
            frames, ends: as for a call. k: (q,) configurations. pairs: (q,) of the same length.

        Returns:
            (q,) m.
        """
        b, (i, j), kinds = self.bodies, (self.bodies.first[pairs], self.bodies.second[pairs]), self._kinds[pairs]
        gaps: Floats = np.empty(len(k))
        for kind in np.unique(kinds).tolist():
            rows = np.flatnonzero(kinds == kind)
            at, one, two = k[rows], i[rows], j[rows]
            if kind != 0:
                gaps[rows] = segment_distances(ends[at, one], ends[at, two]) - (b.radius[one] + b.radius[two])
            if kind == 1:
                continue
            first, second = (frames[at, b.frames[body]] @ b.box_poses[body] for body in (one, two))
            if kind == 0:
                gaps[rows] = _over_plane(ends[at, one], b.radius[one], first, b.half[one], second)
            elif kind == 2:
                gaps[rows] = np.maximum(gaps[rows], _beside(ends[at, one], b.radius[one], second, b.half[two]))
            elif kind == 3:
                gaps[rows] = np.maximum(gaps[rows], _beside(ends[at, two], b.radius[two], first, b.half[one]))
            else:
                gaps[rows] = np.maximum(gaps[rows], box_gaps(first, b.half[one], second, b.half[two]))
        return gaps - ROUNDING

    def __call__(self, frames: Floats, ends: Floats, wanted: Bools) -> Floats:
        """Bounds of some pairs.

        Args:
            frames: (K, F, 4, 4) in the world. ends: (K, B, 2, 3) m, axes of the bounding capsules in the world.
            wanted: (P,) pairs of interest; the others get infinity.

        Returns:
            (K, P) m.
        """
        result: Floats = np.full((len(frames), len(wanted)), np.inf)
        step = max(1, _AT_ONCE // max(1, int(np.count_nonzero(wanted))))
        for start in range(0, len(frames), step):
            some = slice(start, start + step)
            self._fill(frames[some], ends[some], wanted, result[some])
        return result

    def apart(self, frames: Floats, ends: Floats, k: Ints, pairs: Ints) -> Floats:
        """Distances of capsules and balls beside boxes.

        Args:
            frames, ends: as above.
            k: (q,) configurations. pairs: (q,) of the same length.

        Returns:
            (q,) m; NaN for other pairs, and where a segment meets a box.
        """
        b = self.bodies
        result: Floats = np.full(len(k), np.nan)
        for thin, boxed, those in (
            (b.first, b.second, self._thin_first[pairs]),
            (b.second, b.first, self._thin_second[pairs]),
        ):
            if not np.any(those):
                continue
            at, i, j = k[those], thin[pairs[those]], boxed[pairs[those]]
            box = frames[at, b.frames[j]] @ b.box_poses[j]
            inside = (ends[at, i] - box[:, None, :3, 3]) @ box[:, :3, :3]
            gaps = exact_box_distances(inside, b.half[j])
            result[those] = np.where(gaps > 0.0, gaps - b.radius[i], np.nan)
        return result

    def _fill(self, frames: Floats, ends: Floats, wanted: Bools, result: Floats) -> None:
        b, first, second = self.bodies, self.bodies.first, self.bodies.second
        solid = self._solid[wanted[self._solid]]
        segments = segment_distances(ends[:, first[solid]], ends[:, second[solid]])
        result[:, solid] = segments - (b.radius[first[solid]] + b.radius[second[solid]])
        boxes = frames[:, b.frames] @ b.box_poses  # (K, B, 4, 4)
        for pairs, bound in (
            (self._planes, self._over_planes),
            (self._box_second, self._beside_second),
            (self._box_first, self._beside_first),
            (self._boxes, self._between_boxes),
        ):
            some = pairs[wanted[pairs]]
            if len(some):
                bound(some, boxes, ends, result)
        result -= ROUNDING

    def _over_planes(self, pairs: Ints, boxes: Floats, ends: Floats, result: Floats) -> None:
        """Bodies over half-spaces."""
        b, i = self.bodies, self.bodies.first[pairs]
        plane = boxes[:, self.bodies.second[pairs]]
        result[:, pairs] = _over_plane(ends[:, i], b.radius[i], boxes[:, i], b.half[i], plane)

    def _beside_second(self, pairs: Ints, boxes: Floats, ends: Floats, result: Floats) -> None:
        """First bodies that are capsules beside second ones in boxes."""
        self._beside(pairs, self.bodies.first[pairs], self.bodies.second[pairs], boxes, ends, result)

    def _beside_first(self, pairs: Ints, boxes: Floats, ends: Floats, result: Floats) -> None:
        """Second bodies that are capsules beside first ones in boxes."""
        self._beside(pairs, self.bodies.second[pairs], self.bodies.first[pairs], boxes, ends, result)

    def _beside(self, pairs: Ints, thin: Ints, boxed: Ints, boxes: Floats, ends: Floats, result: Floats) -> None:
        """Capsules beside boxes."""
        b = self.bodies
        gaps = _beside(ends[:, thin], b.radius[thin], boxes[:, boxed], b.half[boxed])
        result[:, pairs] = np.maximum(result[:, pairs], gaps)

    def _between_boxes(self, pairs: Ints, boxes: Floats, ends: Floats, result: Floats) -> None:
        """Bodies in boxes among themselves."""
        b, i, j = self.bodies, self.bodies.first[pairs], self.bodies.second[pairs]
        gaps = box_gaps(boxes[:, i], b.half[i], boxes[:, j], b.half[j])
        result[:, pairs] = np.maximum(result[:, pairs], gaps)


def _over_plane(ends: Floats, radius: Floats, box: Floats, half: Floats, plane: Floats) -> Floats:
    """(...) m, of bodies over half-spaces: the lower end of their capsule, or the lowest corner of their box.

    Args:
        ends: (..., 2, 3) m and radius: (...) m, of the capsules. box: (..., 4, 4) and half: (..., 3) m, of the boxes.
        plane: (..., 4, 4), the half-spaces lie below z = 0.
    """
    origin, normal = plane[..., :3, 3], plane[..., :3, 2]  # a half-space has no box: this is its frame
    heights = np.einsum("...ea,...a->...e", ends - origin[..., None, :], normal)
    by_capsule = np.min(heights, axis=-1) - radius
    middle = np.einsum("...a,...a->...", box[..., :3, 3] - origin, normal)
    down = np.einsum("...b,...b->...", np.abs(np.einsum("...ab,...a->...b", box[..., :3, :3], normal)), half)
    gaps: Floats = np.maximum(by_capsule, middle - down)
    return gaps


def _beside(ends: Floats, radius: Floats, box: Floats, half: Floats) -> Floats:
    """(...) m, of capsules with ends (..., 2, 3) and radii (...) beside boxes (..., 4, 4) of half sides (..., 3)."""
    inside = (ends - box[..., None, :3, 3]) @ box[..., :3, :3]
    gaps: Floats = box_distances(inside, half) - radius
    return gaps
