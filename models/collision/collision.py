"""Distances between everything in a cell: many configurations bounded at once in NumPy, Coal only for what is near."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints, set_frozen
from duocell.models.cell.mounting import Mounting, face_depth
from duocell.models.cell.surroundings import PairClass, Surroundings
from duocell.models.collision.collision_bodies import EVERY, CellBodies, Owner, collect, frame_offsets
from duocell.models.collision.pair_bounds import PairBounds
from duocell.models.geometry.separation import Separation, separation
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.arm import Arm


@dataclass(frozen=True, eq=False)
class Contact:
    """The nearest points of two bodies (or the deepest, where they penetrate).

    Attributes:
        kind: class of the pair.
        distance: m, signed. ``distance = normal · (point_second - point_first)``.
        first: name of a body. second: likewise.
        first_owner: what the first body moves with. second_owner: likewise.
        point_first: (3,) m in the world. point_second: likewise.
        normal: (3,) unit, in the world, from the first body to the second.
        pair: its number in the model.
    """

    kind: PairClass
    distance: float
    first: str
    second: str
    first_owner: Owner
    second_owner: Owner
    point_first: Floats
    point_second: Floats
    normal: Floats
    pair: int

    def __post_init__(self) -> None:
        for name in ("point_first", "point_second", "normal"):
            set_frozen(self, name, getattr(self, name), (3,))


@dataclass(frozen=True, eq=False)
class Configurations:
    """Where everything is, for K configurations of all arms.

    Attributes:
        frames: (K, F, 4, 4) in the world: world, object, then the links of each arm.
        ends: (K, B, 2, 3) m, axes of the bounding capsules in the world.
        counted: (P,) pairs that count: not a base with what it is mounted on.
        segments: (K,) number of the segment of the task that each configuration belongs to.
    """

    frames: Floats
    ends: Floats
    counted: Bools
    segments: Ints

    def __len__(self) -> int:
        return len(self.frames)


class CollisionModel:
    """Bodies and pairs of a cell; build it once, ask it often. Classes without a clearance are not looked at."""

    def __init__(self, arms: Sequence[Arm], surroundings: Surroundings, holders: Sequence[Arm] | None = None) -> None:
        """Collect bodies and pairs.

        Args:
            arms: of the cell; robots, grasps and limits are used.
            surroundings: everything else.
            holders: all arms that hold the part, where ``arms`` are only some of them; ``arms`` by default. The part is
                left out around their grasps.
        """
        self.arms = tuple(arms)
        self.bodies: CellBodies = collect(arms, surroundings, holders)
        self.offsets = frame_offsets(arms)
        self._depths = [face_depth(surroundings, arm) for arm in arms]
        b = self.bodies
        self._bounds = PairBounds(b)
        self.exact_bounds: Bools = self._bounds.exact
        self._of_segments = bool(np.any(b.segments != EVERY))
        self._mounts = np.flatnonzero(b.mounts)
        self._mount_arms = np.array([b.owners[i].arm for i in b.first[self._mounts]], dtype=np.int64)
        self._obstacles: Ints = np.unique(b.second[self._mounts])
        self._mounting = Mounting([b.bodies[i] for i in self._obstacles])
        self._last: tuple[bytes, Bools] = b"", np.ones(len(b.first), dtype=np.bool_)  # of the last bases
        self._bolted: Bools | None = None  # pairs that count wherever the bases are
        self._of_kind = {
            kind: np.flatnonzero([k is kind for k in b.kinds]) for kind in PairClass if kind in set(b.kinds)
        }

    @property
    def kinds(self) -> tuple[PairClass, ...]:
        """Classes with at least one pair."""
        return tuple(self._of_kind)

    def bolted(self, bases: Floats) -> CollisionModel:
        """The model of arms bolted down at (A, 4, 4), for bases that are not quite there.

        What an arm stands on there does not count for it, wherever it is then placed.
        """
        model = copy(self)
        model._bolted = self.counted(bases)
        return model

    def configure(
        self, bases: Floats, joints: Sequence[Floats], objects: Floats, segments: Ints | None = None
    ) -> Configurations:
        """Place everything.

        Args:
            bases: (A, 4, 4) base of each arm in the world.
            joints: per arm (K, n) rad.
            objects: (K, 4, 4) object frame in the world.
            segments: (K,) numbers of the segments; the first one by default.
        """
        frames: Floats = np.empty((len(objects), self.offsets[-1], 4, 4))
        frames[:, 0] = np.eye(4)
        frames[:, 1] = objects
        for arm, base, q, start in zip(self.arms, bases, joints, self.offsets[:-1], strict=True):
            np.matmul(base, link_frames(arm.robot, q), out=frames[:, start : start + arm.dof + 1])
        of_segment = np.zeros(len(objects), dtype=np.int64) if segments is None else segments
        return Configurations(frames, self._ends(frames), self.counted(bases), of_segment)

    def configure_layouts(
        self, bases: Floats, joints: Sequence[Floats], objects: Floats, segments: Ints
    ) -> Configurations:
        """Place everything for many layouts of one task at once.

        Args:
            bases: (L, A, 4, 4) base of each arm in the world.
            joints: per arm (L, m, n) rad.
            objects: (m, 4, 4) object frame in the world. segments: (m,) the segment that each belongs to.

        Returns:
            L · m configurations, layout after layout; which pairs count differs between layouts and is left to the
            caller (`counted`): here all do.
        """
        many, m = len(bases), len(objects)
        frames: Floats = np.empty((many * m, self.offsets[-1], 4, 4))
        frames[:, 0] = np.eye(4)
        frames[:, 1] = np.tile(objects, (many, 1, 1))
        for a, (arm, q, start) in enumerate(zip(self.arms, joints, self.offsets[:-1], strict=True)):
            links = link_frames(arm.robot, q.reshape(many * m, arm.dof))
            np.matmul(np.repeat(bases[:, a], m, axis=0)[:, None], links, out=frames[:, start : start + arm.dof + 1])
        return Configurations(
            frames, self._ends(frames), np.ones(len(self.bodies.first), dtype=np.bool_), np.tile(segments, many)
        )

    def arranged(self, frames: Floats, segments: Ints, counted: Bools) -> Configurations:
        """Configurations whose frames are known.

        Args:
            frames: (K, F, 4, 4) in the world, as in `Configurations`. segments: (K,) numbers of the segments.
            counted: (P,) pairs that count; frames that these do not need may be anything.
        """
        return Configurations(frames, self._ends(frames), counted, segments)

    def _ends(self, frames: Floats) -> Floats:
        own = frames[:, self.bodies.frames]
        ends: Floats = self.bodies.ends @ own[..., :3, :3].swapaxes(-1, -2) + own[..., None, :3, 3]
        return ends

    def bounds(
        self, configurations: Configurations, pairs: Bools | None = None, enough: Floats | None = None
    ) -> Floats:
        """(K, P) m, lower bounds of the signed distances of all pairs; infinite for pairs that do not count.

        Exact, less `ROUNDING`, where `exact_bounds` says so.

        Args:
            configurations: to look at.
            pairs: (P,) those of interest; the others get infinity.
            enough: (P,) m; bounds beyond these are of no interest, and may be any that are beyond as well.
        """
        wanted = configurations.counted if pairs is None else configurations.counted & pairs
        if enough is None:
            result = self._bounds(configurations.frames, configurations.ends, wanted)
        else:
            result = self._bounds.up_to(configurations.frames, configurations.ends, wanted, enough)
        if self._of_segments:
            result[(self.bodies.segments != EVERY) & (self.bodies.segments != configurations.segments[:, None])] = (
                np.inf
            )
        return result

    def distances(self, configurations: Configurations, k: Ints, pairs: Ints) -> Floats:
        """(q,) m, signed distances of pairs (q,) in configurations k (q,): in closed form if there is one, by Coal."""
        found = self._bounds.apart(configurations.frames, configurations.ends, k, pairs)
        for index in np.flatnonzero(np.isnan(found)):
            found[index] = self._separation(configurations, int(k[index]), int(pairs[index])).distance
        return found

    def _separation(self, configurations: Configurations, k: int, pair: int) -> Separation:
        b = self.bodies
        i, j = b.first[pair], b.second[pair]
        frames, first, second = configurations.frames[k], b.bodies[i], b.bodies[j]
        poses = frames[b.frames[i]] @ first.pose, frames[b.frames[j]] @ second.pose
        return separation(first.shape, poses[0], second.shape, poses[1])

    def contact(self, configurations: Configurations, k: int, pair: int) -> Contact:
        """Coal's answer for one pair in configuration k."""
        b = self.bodies
        i, j = int(b.first[pair]), int(b.second[pair])
        found = self._separation(configurations, k, pair)
        return Contact(
            kind=b.kinds[pair],
            distance=found.distance,
            first=b.names[i],
            second=b.names[j],
            first_owner=b.owners[i],
            second_owner=b.owners[j],
            point_first=found.point_first,
            point_second=found.point_second,
            normal=found.normal,
            pair=pair,
        )

    def closest(
        self, configurations: Configurations, kind: PairClass, bounds: Floats | None = None
    ) -> tuple[int, Contact] | None:
        """The closest pair of a class over all configurations, with the configuration's number.

        Pairs are asked for in the order of their bounds until no other can be closer. None if no pair counts.

        Args:
            configurations: to look at.
            kind: class of pairs.
            bounds: (K, P) m if known already; infinity hides a pair.
        """
        known = self.bounds(configurations) if bounds is None else bounds
        of_kind = self._of_kind.get(kind)
        if of_kind is None or len(known) == 0:
            return None
        return self.closest_of(configurations, of_kind, known[:, of_kind])

    def closest_of(self, configurations: Configurations, pairs: Ints, bounds: Floats) -> tuple[int, Contact] | None:
        """The closest of some pairs (q,) over all configurations, with the configuration's number.

        Args:
            configurations: to look at. pairs: their numbers. bounds: (K, q) m; infinity hides a pair.
        """
        flat = bounds.ravel()
        first = int(np.argmin(flat)) if flat.size else 0
        if not flat.size or not flat[first] < np.inf:
            return None
        k, p = divmod(first, len(pairs))
        best = k, self.contact(configurations, k, int(pairs[p]))
        near = np.flatnonzero(flat < best[1].distance)  # few: sorting all would take far longer
        for index in near[np.argsort(flat[near], kind="stable")]:
            k, p = divmod(int(index), len(pairs))
            if not flat[index] < best[1].distance:
                break
            if index == first:
                continue
            contact = self.contact(configurations, k, int(pairs[p]))
            if contact.distance < best[1].distance:
                best = k, contact
        return best

    def contacts(
        self, bases: Floats, joints: Sequence[Floats], object_in_world: Floats, segment: int = 0
    ) -> dict[PairClass, Contact]:
        """The closest pair of every class for one configuration.

        Args:
            bases: (A, 4, 4) base of each arm in the world.
            joints: per arm (n,) rad.
            object_in_world: (4, 4).
            segment: number of the segment.
        """
        here = self.configure(bases, [q[None] for q in joints], object_in_world[None], np.array([segment]))
        bounds = self.bounds(here)
        found = {kind: self.closest(here, kind, bounds) for kind in self._of_kind}
        return {kind: entry[1] for kind, entry in found.items() if entry is not None}

    def near(
        self,
        bases: Floats,
        joints: Sequence[Floats],
        object_in_world: Floats,
        within: Mapping[PairClass, float],
        segment: int = 0,
    ) -> list[Contact]:
        """All pairs nearer than a distance [m] given per class, closest first; arguments as for `contacts`."""
        here = self.configure(bases, [q[None] for q in joints], object_in_world[None], np.array([segment]))
        limits = np.array([within.get(kind, -np.inf) for kind in self.bodies.kinds])
        candidates = np.flatnonzero(self.bounds(here)[0] < limits)
        found = [self.contact(here, 0, int(pair)) for pair in candidates]
        return sorted((c for c in found if c.distance < limits[c.pair]), key=lambda c: c.distance)

    def counted(self, bases: Floats) -> Bools:
        """(P,) False where a base meets what it is mounted on (`duocell.models.cell.mounting`), for bases (A, 4, 4)."""
        if self._bolted is not None:
            return self._bolted
        key = np.asarray(bases).tobytes()
        if key != self._last[0]:
            self._last = key, self.counted_layouts(np.asarray(bases)[None])[0]
        return self._last[1]

    def counted_layouts(self, bases: Floats) -> Bools:
        """(L, P) the same for many layouts (L, A, 4, 4) at once."""
        if self._bolted is not None:
            return np.tile(self._bolted, (len(bases), 1))
        counted: Bools = np.ones((len(bases), len(self.bodies.first)), dtype=np.bool_)
        for arm in np.unique(self._mount_arms):
            own = self._mounts[self._mount_arms == arm]
            counted[:, own] = ~self.carriers(int(arm), bases[:, arm])[:, self.bodies.second[own]]
        return counted

    def carriers(self, arm: int, bases: Floats) -> Bools:
        """(N, B) True for the body that an arm's base is mounted on, for bases (N, 4, 4) in the world."""
        found: Bools = np.zeros((len(bases), len(self.bodies.bodies)), dtype=np.bool_)
        found[:, self._obstacles] = self._mounting.carriers(bases, self._depths[arm])
        return found

    def surely_counted(self, arm: int, bases: Floats, shifts: Floats) -> Bools:
        """(N, P) False where an arm's base may be mounted on the second body, for some base around given ones.

        Args:
            arm: its index; pairs of other arms are True.
            bases: (N, 4, 4) in the world.
            shifts: (N,) m, how far the others' origins lie from these at most; their z axes point the same way.
        """
        counted: Bools = np.ones((len(bases), len(self.bodies.first)), dtype=np.bool_)
        own = self._mounts[self._mount_arms == arm]
        possible: Bools = np.zeros((len(bases), len(self.bodies.bodies)), dtype=np.bool_)
        possible[:, self._obstacles] = self._mounting.possible_carriers(bases, self._depths[arm], shifts)
        counted[:, own] = ~possible[:, self.bodies.second[own]]
        return counted
