"""Distances of some pairs of a cell at many configurations: bounds first, closed forms for what they leave open.

What collides surely is found without Coal; pairs that only Coal can measure are given the benefit of the doubt.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.collision.collision import CollisionModel
from duocell.models.collision.collision_bodies import EVERY, CellBodies
from duocell.models.collision.pair_bounds import PairBounds
from duocell.models.geometry.bounding import exact_box_distances, segment_distances
from duocell.models.geometry.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere


@dataclass(frozen=True, eq=False, slots=True)
class SomePairs:
    """Some pairs of a collision model, with only the bodies that they need.

    Attributes:
        bodies: of these pairs; their frames are numbered as in the model. pairs: (Q,) their numbers in the model.
        frames: (F',) numbers of the frames that are needed. bounds: of the pairs.
        required: (Q,) m, distances to keep. segments: (Q,) as in the model.
        closed: (Q,) True for capsules and balls beside boxes, whose distances have a closed form.
        inner: capsules inside of the bodies.
    """

    bodies: CellBodies
    pairs: Ints
    frames: Ints
    bounds: PairBounds
    required: Floats
    segments: Ints
    closed: Bools
    inner: InnerCapsules

    @staticmethod
    def of(model: CollisionModel, required: Floats, wanted: Bools) -> SomePairs:
        """Select pairs.

        Args:
            model: of the cell. required: (P,) m. wanted: (P,) True for the pairs to be kept.
        """
        b, pairs = model.bodies, np.flatnonzero(wanted)
        used = np.unique(np.concatenate([b.first[pairs], b.second[pairs]]))
        frames = np.unique(b.frames[used])
        some = replace(
            b,
            names=tuple(b.names[i] for i in used),
            owners=tuple(b.owners[i] for i in used),
            bodies=tuple(b.bodies[i] for i in used),
            sure=tuple(b.sure[i] for i in used),
            frames=np.searchsorted(frames, b.frames[used]),
            ends=b.ends[used],
            radius=b.radius[used],
            box_poses=b.box_poses[used],
            half=b.half[used],
            rounded=b.rounded[used],
            flat=b.flat[used],
            first=np.searchsorted(used, b.first[pairs]),
            second=np.searchsorted(used, b.second[pairs]),
            kinds=tuple(b.kinds[i] for i in pairs),
            mounts=b.mounts[pairs],
            segments=b.segments[pairs],
        )
        box = np.array([isinstance(body.shape, Box) for body in some.bodies], dtype=np.bool_)
        first, second = some.first, some.second
        closed = (some.rounded[first] & box[second]) | (some.rounded[second] & box[first])
        bounds, inner = PairBounds(some), InnerCapsules.of(some)
        return SomePairs(some, pairs, frames, bounds, required[pairs], b.segments[pairs], closed, inner)

    def violations(self, frames: Floats, segments: Ints) -> Floats:
        """(K, Q) m, by how much pairs surely violate their distances, 0 where they may keep them.

        Args:
            frames: (K, F', 4, 4) in the world. segments: (K,) of the configurations.
        """
        own = frames[:, self.bodies.frames]
        ends: Floats = self.bodies.ends @ own[..., :3, :3].swapaxes(-1, -2) + own[..., None, :3, 3]
        every: Bools = np.ones(len(self.pairs), dtype=np.bool_)
        margins = self.bounds.up_to(frames, ends, every, self.required) - self.required
        if np.any(self.segments != EVERY):
            margins[(self.segments != EVERY) & (self.segments != segments[:, None])] = np.inf
        violations: Floats = np.maximum(-margins, 0.0)
        k, pairs = np.nonzero((violations > 0.0) & ~self.bounds.exact)
        violations[k, pairs] = self._upper(frames, ends, k, pairs)
        return violations

    def _upper(self, frames: Floats, ends: Floats, k: Ints, pairs: Ints) -> Floats:
        """(q,) m, sure violations by pairs (q,) in configurations (q,), as far as closed forms tell."""
        if not len(k):
            return np.zeros(0)
        closed = self.closed[pairs]
        gaps = np.full(len(k), np.inf)
        gaps[closed] = self.bounds.apart(frames, ends, k[closed], pairs[closed])
        gaps[~closed] = self.inner.gaps(frames, k[~closed], pairs[~closed])
        first, second = self.bodies.first[pairs], self.bodies.second[pairs]
        thin: Floats = np.where(self.bodies.rounded[first], self.bodies.radius[first], self.bodies.radius[second])
        gaps = np.where(np.isnan(gaps), -thin, gaps)  # a segment inside of a box
        violations: Floats = np.maximum(self.required[pairs] - gaps, 0.0)
        return violations


@dataclass(frozen=True, eq=False, slots=True)
class InnerCapsules:
    """Capsules inside of the bodies of some pairs: bodies are no farther apart than these.

    Attributes:
        bodies: the bodies. ends: (B, 2, 3) m, in the frames that they move with. radius: (B,) m.
    """

    bodies: CellBodies
    ends: Floats
    radius: Floats

    @staticmethod
    def of(bodies: CellBodies) -> InnerCapsules:
        """The largest simple ones."""
        ends, radius = np.zeros((len(bodies.bodies), 2, 3)), np.zeros(len(bodies.bodies))
        for i, body in enumerate(bodies.bodies):
            own, radius[i] = inner_capsule(body.shape)
            ends[i] = own @ body.pose[:3, :3].T + body.pose[:3, 3]
        return InnerCapsules(bodies, ends, radius)

    def gaps(self, frames: Floats, k: Ints, pairs: Ints) -> Floats:
        """(q,) m, upper bounds of the signed distances of pairs (q,) in configurations (q,)."""
        b = self.bodies
        first, second = b.first[pairs], b.second[pairs]
        one, other = (self._placed(frames, k, bodies) for bodies in (first, second))
        gaps: Floats = segment_distances(one, other) - self.radius[first] - self.radius[second]
        plane = frames[k, b.frames[second]] @ b.box_poses[second]
        heights = np.einsum("qea,qa->qe", one - plane[:, None, :3, 3], plane[:, :3, 2])
        gaps = np.where(b.flat[second], heights.min(axis=1) - self.radius[first], gaps)
        for thin, ends, boxed in ((first, one, second), (second, other, first)):
            some = np.flatnonzero(np.array([isinstance(b.bodies[i].shape, Box) for i in boxed], dtype=np.bool_))
            box = frames[k[some], b.frames[boxed[some]]] @ b.box_poses[boxed[some]]
            inside = (ends[some] - box[:, None, :3, 3]) @ box[:, :3, :3]
            beside = exact_box_distances(inside, b.half[boxed[some]]) - self.radius[thin[some]]
            gaps[some] = np.minimum(gaps[some], beside)
        return gaps

    def _placed(self, frames: Floats, k: Ints, bodies: Ints) -> Floats:
        """(q, 2, 3) m, ends in the world."""
        own = frames[k, self.bodies.frames[bodies]]
        placed: Floats = self.ends[bodies] @ own[:, :3, :3].swapaxes(1, 2) + own[:, None, :3, 3]
        return placed


def inner_capsule(shape: Shape) -> tuple[Floats, float]:
    """Ends (2, 3) [m] and radius [m] of a capsule inside of a shape, in its own frame."""
    match shape:
        case Sphere(radius=radius):
            return np.zeros((2, 3)), radius
        case Capsule(radius=radius, length=length):
            return np.array([[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]]), radius
        case Cylinder(radius=radius, length=length):
            inner = min(radius, 0.5 * length)
            return np.array([[0.0, 0.0, inner - 0.5 * length], [0.0, 0.0, 0.5 * length - inner]]), inner
        case Box(size=size):
            longest = int(np.argmax(size))
            inner = 0.5 * float(np.min(size))
            half = (0.5 * float(size[longest]) - inner) * np.eye(3)[longest]
            return np.array([-half, half]), inner
        case ConvexHull(points=points, planes=planes):
            middle = points.mean(axis=0)
            return np.array([middle, middle]), float(np.min(-(planes[:, :3] @ middle + planes[:, 3])))
        case HalfSpace():
            return np.zeros((2, 3)), 0.0
