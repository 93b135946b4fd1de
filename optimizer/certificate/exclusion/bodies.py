"""The bodies of one arm as inscribed capsules and points, and everything that they must keep away from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel
from duocell.models.collision.collision_bodies import EVERY
from duocell.models.geometry.shapes import Body
from duocell.optimizer.certificate.exclusion.causes import Causes, link_pair
from duocell.optimizer.certificate.exclusion.inscribed import InnerCapsule, axis_capsules, edge_points, inner_capsules


@dataclass(frozen=True, eq=False, slots=True)
class Points:
    """Centres of balls inside of bodies.

    Attributes:
        link: (P,) number of the link. place: (P, 3) m in its frame. radius: (P,) m; 0 for points on edges.
        body: (P,) number of the body in the collision model.
        sure: (P,) False for points of a pedestal that are below its foot where the base stands low: nothing but an
            obstacle, which is no wider there than at the foot, is surely hit by them.
    """

    link: Ints
    place: Floats
    radius: Floats
    body: Ints
    sure: Bools

    def __len__(self) -> int:
        return len(self.link)

    def __getitem__(self, rows: Ints | Bools) -> Points:
        return Points(self.link[rows], self.place[rows], self.radius[rows], self.body[rows], self.sure[rows])

    def placed(self, frames: Floats) -> Floats:
        """(..., P, 3) m in the world, for link frames (..., L, 4, 4) there."""
        own = frames[..., self.link, :, :]
        places: Floats = (own[..., :3, :3] @ self.place[..., None])[..., 0] + own[..., :3, 3]
        return places


@dataclass(frozen=True, eq=False, slots=True)
class Capsules:
    """Capsules inside of bodies.

    Attributes:
        link: (C,) number of the link. ends: (C, 2, 3) m in its frame. radius: (C,) m.
        body: (C,) number of the body in the collision model.
    """

    link: Ints
    ends: Floats
    radius: Floats
    body: Ints

    def __len__(self) -> int:
        return len(self.link)

    def placed(self, frames: Floats) -> Floats:
        """(..., C, 2, 3) m in the world, for link frames (..., L, 4, 4) there."""
        own = frames[..., self.link, :, :]
        ends: Floats = self.ends @ own[..., :3, :3].swapaxes(-1, -2) + own[..., None, :3, 3]
        return ends


@dataclass(frozen=True, eq=False, slots=True)
class Other:
    """A body that is no arm's, and what of an arm must keep away from it.

    Attributes:
        body: in the world, or in the object frame where ``part``. part: True if the hand carries it.
        segment: number of the segment in which it counts, or `EVERY`. cause: its number.
        points: (k,) indices of the points kept away from it. required: (k,) m.
        pairs: (k,) numbers of the pairs in the collision model.
    """

    body: Body
    part: bool
    segment: int
    cause: int
    points: Ints
    required: Floats
    pairs: Ints

    def frames(self, objects: Floats, segments: Ints) -> list[tuple[slice, Floats]]:
        """Where the body stands, as (poses, (4, 4)).

        Args:
            objects: (m, 4, 4) object frame in the world. segments: (m,) number of the segment of every pose.
        """
        if not self.part:
            return [(slice(None), self.body.pose)]
        some = [j for j in range(len(objects)) if self.segment in (EVERY, int(segments[j]))]
        return [(slice(j, j + 1), objects[j] @ self.body.pose) for j in some]


@dataclass(frozen=True, eq=False, slots=True)
class SelfPair:
    """Two capsules of one arm; ``first`` is on the link with the lower number. ``required`` m, number of the cause."""

    first: int
    second: int
    required: float
    cause: int


@dataclass(frozen=True, eq=False, slots=True)
class BasePair:
    """Points of a body of the base, by index (k,), and a capsule of a moving link.

    Attributes:
        points: (k,). capsule: index. required: m between them. cause: its number.
    """

    points: Ints
    capsule: int
    required: float
    cause: int


@dataclass(frozen=True, eq=False, slots=True)
class SolidPair:
    """A whole body of the base and one that is no arm's; number of the pair in the collision model."""

    body: Body
    other: Other
    required: float
    pair: int


@dataclass(frozen=True, eq=False, slots=True)
class ArmBodies:
    """What the tests of one arm need of its bodies.

    Attributes:
        capsules: of the links; of the base link those on the yaw axis only, which every yaw leaves in place.
        points: in them, and on edges of the bodies of moving links.
        others: obstacles, and the bodies of the part, that points must keep away from.
        self_pairs: of capsules.
        base_points: inside of the base's bodies, off the axis too: they turn with the yaw.
        base_others: what these must keep away from; points and pairs count those of ``base_points``.
        base_pairs: of the base's points with moving links. base_solids: of the base's whole bodies.
    """

    capsules: Capsules
    points: Points
    others: tuple[Other, ...]
    self_pairs: tuple[SelfPair, ...]
    base_points: Points
    base_others: tuple[Other, ...]
    base_pairs: tuple[BasePair, ...]
    base_solids: tuple[SolidPair, ...]

    @staticmethod
    def of(model: CollisionModel | None, arm: int, required: Floats, causes: Causes) -> ArmBodies:
        """Inscribe an arm's bodies.

        Args:
            model: of the cell; None where no distance is asked for. arm: index. required: (P,) m, of the model's pairs.
            causes: of the arm.
        """
        if model is None:
            return ArmBodies(_capsules([]), _points([], []), (), (), _points([], []), (), (), ())
        b = model.bodies
        own = [i for i, owner in enumerate(b.owners) if owner.arm == arm]
        moving, fixed = [i for i in own if b.owners[i].link], [i for i in own if not b.owners[i].link]
        grown = [i for i in fixed if b.sure[i] is not b.bodies[i]]
        numbered = [(i, capsule) for i in fixed for capsule in axis_capsules(b.sure[i])]
        numbered += [(i, capsule) for i in moving for capsule in inner_capsules(b.bodies[i])]
        link_of = {i: int(b.frames[i]) - model.offsets[arm] for i in own}
        capsules = _capsules([(link_of[i], capsule, i) for i, capsule in numbered])
        in_rows = [(link_of[i], centre, capsule.radius, i) for i, capsule in numbered for centre in capsule.centres()]
        edges = [(link_of[i], place, 0.0, i) for i in moving for place in edge_points(b.bodies[i])]
        below = [row for i in grown for row in _rows(i, axis_capsules(b.bodies[i]))]
        points = _points(in_rows + edges, below)
        turning = [row for i in fixed for row in _turning(i, b.sure[i])]
        base = _points(turning, [row for i in grown for row in _turning(i, b.bodies[i])])
        return ArmBodies(
            capsules,
            points,
            _others(model, points, required, causes),
            _self_pairs(model, capsules, own, required, causes),
            base,
            base_others := _others(model, base, required, causes),
            _base_pairs(model, base, capsules, own, required, causes),
            _base_solids(model, base_others, fixed, required),
        )


def _capsules(rows: list[tuple[int, InnerCapsule, int]]) -> Capsules:
    return Capsules(
        np.array([link for link, _, _ in rows], dtype=np.int64),
        np.array([capsule.ends for _, capsule, _ in rows]).reshape(-1, 2, 3),
        np.array([capsule.radius for _, capsule, _ in rows], dtype=np.float64),
        np.array([body for _, _, body in rows], dtype=np.int64),
    )


_Row = tuple[int, Floats, float, int]
"""Link, place, radius and body of a point."""


def _rows(number: int, capsules: list[InnerCapsule]) -> list[_Row]:
    """Points on the axes of capsules in a body of the base."""
    return [(0, centre, capsule.radius, number) for capsule in capsules for centre in capsule.centres()]


def _turning(number: int, body: Body) -> list[_Row]:
    """Points all over a body of the base."""
    return _rows(number, inner_capsules(body)) + [(0, place, 0.0, number) for place in edge_points(body)]


def _points(sure: list[_Row], below: list[_Row]) -> Points:
    """Points that are in a body wherever its base stands, and those that may be below the foot of a pedestal."""
    rows = sure + below
    return Points(
        np.array([link for link, _, _, _ in rows], dtype=np.int64),
        np.array([place for _, place, _, _ in rows]).reshape(-1, 3),
        np.array([radius for _, _, radius, _ in rows], dtype=np.float64),
        np.array([body for _, _, _, body in rows], dtype=np.int64),
        np.arange(len(rows)) < len(sure),
    )


def _others(model: CollisionModel, points: Points, required: Floats, causes: Causes) -> tuple[Other, ...]:
    """What is of no arm, with the points of an arm that must keep away from it."""
    b = model.bodies
    own = np.unique(points.body)
    found = []
    for j in np.unique(b.second):
        if b.owners[j].arm is not None:
            continue
        pairs = np.flatnonzero((b.second == j) & np.isin(b.first, own))
        if not len(pairs):
            continue
        pair_of = {int(b.first[pair]): int(pair) for pair in pairs}
        part = b.owners[j].part
        kept = np.flatnonzero(np.isin(points.body, b.first[pairs]) & (points.sure | (not part)))
        numbers = np.array([pair_of[int(points.body[k])] for k in kept], dtype=np.int64)
        cause = causes.part if part else causes.of_obstacle[int(j)]
        found.append(Other(b.bodies[j], part, int(b.segments[pairs[0]]), cause, kept, required[numbers], numbers))
    return tuple(found)


def _self_pairs(
    model: CollisionModel, capsules: Capsules, own: list[int], required: Floats, causes: Causes
) -> tuple[SelfPair, ...]:
    b = model.bodies
    found = []
    for pair in np.flatnonzero([kind is PairClass.SELF for kind in b.kinds]):
        i, j = b.first[pair], b.second[pair]
        if i not in own:
            continue
        cause = causes.of_links[link_pair(b.owners[i].link, b.owners[j].link)]
        for one in np.flatnonzero(capsules.body == i):
            for other in np.flatnonzero(capsules.body == j):
                first, second = (one, other) if capsules.link[one] <= capsules.link[other] else (other, one)
                found.append(SelfPair(int(first), int(second), float(required[pair]), cause))
    return tuple(found)


def _base_pairs(
    model: CollisionModel, base: Points, capsules: Capsules, own: list[int], required: Floats, causes: Causes
) -> tuple[BasePair, ...]:
    b = model.bodies
    found = []
    for pair in np.flatnonzero([kind is PairClass.SELF for kind in b.kinds]):
        i, j = sorted((int(b.first[pair]), int(b.second[pair])), key=lambda k: b.owners[k].link or 0)
        if i not in own or b.owners[i].link:
            continue
        points = np.flatnonzero((base.body == i) & base.sure)
        cause = causes.of_links[link_pair(0, b.owners[j].link)]
        found += [BasePair(points, int(c), float(required[pair]), cause) for c in np.flatnonzero(capsules.body == j)]
    return tuple(found)


def _base_solids(
    model: CollisionModel, others: tuple[Other, ...], fixed: list[int], required: Floats
) -> tuple[SolidPair, ...]:
    b = model.bodies
    found = []
    for other in others:
        for pair in np.unique(other.pairs):
            i = b.first[pair]
            body = b.sure[i] if other.part else b.bodies[i]
            found += [SolidPair(body, other, float(required[pair]), int(pair))] if i in fixed else []
    return tuple(found)
