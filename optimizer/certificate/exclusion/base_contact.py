"""Base link, pedestal and footprint of an arm: which yaws surely collide, or leave the floor, all over a box.

Where a base turns by at most δ and is shifted by at most |h|, a point at distance ρ from its z axis moves by at most
``|h| + 2 ρ sin(δ/2)``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.pose import rotation_z
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.geometry.separation import separation
from duocell.models.robot.arm import Arm
from duocell.optimizer.certificate.exclusion.bodies import ArmBodies, SolidPair
from duocell.optimizer.certificate.exclusion.causes import FLOOR, TOLERANCE
from duocell.optimizer.certificate.exclusion.gap import gap, inside
from duocell.optimizer.certificate.exclusion.inscribed import axis_distance, radius_of
from duocell.optimizer.certificate.exclusion.motion import Motion
from duocell.optimizer.certificate.exclusion.points import Held
from duocell.optimizer.certificate.exclusion.yaw_cells import YawCells
from duocell.optimizer.verification.scene import world_yaw

SMALL = 0.012
"""m; in boxes whose half sides are no longer, whole bodies are asked for by Coal: that takes 20 to 50 µs a pair."""
CUTS = 4
"""How often a cell of yaws is cut in two there."""
AT_ONCE = 200
"""Boxes and poses at which points of the base are measured from a link together."""
LEVEL = 1e-9
"""A base whose axis is this near to the vertical (1 - cosine) turns its footprint as it yaws."""


@dataclass(frozen=True, eq=False, slots=True)
class BaseContact:
    """The base of one arm.

    Attributes:
        arm: the arm. sigma: sense of joint 1 about the base's z axis: a shift s of it is the yaw -σ s.
        bodies: of the arm. held: where the part is. floor: or None. footprint: of the base.
    """

    arm: Arm
    sigma: int
    bodies: ArmBodies
    held: Held
    floor: Floor | None
    footprint: Footprint

    @property
    def useful(self) -> bool:
        """True if some yaw could be lost to anything."""
        return bool(self.bodies.base_others or self.bodies.base_pairs or self._plate)

    @property
    def _plate(self) -> bool:
        """True where a yaw turns a footprint that is not round."""
        level = abs(abs(float(self.arm.mount[2, 2])) - 1.0) < LEVEL
        return self.floor is not None and level and bool(np.max(np.abs(self.footprint.corners)) > 1e-6)

    def live(
        self, motion: Motion, cells: YawCells, mounted: Bools, levels: dict[int, float], every: bool = False
    ) -> Bools:
        """(N, n) False for cells of yaws in which the base surely hits something or leaves the floor.

        Args:
            motion: over N boxes. cells: of their yaws.
            mounted: (N, P) True for pairs of the collision model that may be what the base is mounted on.
            levels: m below which a slack excludes, by number of the cause, 0 by default; -inf leaves a cause out.
            every: ask for whole bodies in dear cells too where a cheaper one is left.
        """
        yaw = -self.sigma * cells.shift
        live = np.isfinite(cells.cost)
        if self._plate:
            live &= ~self._off_floor(motion, cells, yaw, levels.get(FLOOR, 0.0))
        if len(self.bodies.base_points):
            points = self.bodies.base_points
            reach = np.hypot(points.place[:, 0], points.place[:, 1])
            moved = motion.shift[:, None, None] + 2.0 * np.sin(0.5 * cells.half)[:, None, None] * reach
            places = self._turned(motion, yaw)
            self._hit(motion, places, moved, live, mounted, levels)
            self._hit_itself(motion, places, moved, live, levels)
        self._hit_whole(motion, cells, yaw, live, mounted, levels, every)
        return live

    def _turned(self, motion: Motion, yaw: Floats) -> Floats:
        """(N, n, P, 3) m, the base's points for yaws (N, n) about the centres of the boxes."""
        turned = np.einsum("ab,Nnbc,Pc->NnPa", self.arm.mount, rotation_z(yaw), self.bodies.base_points.place)
        places: Floats = turned + motion.boxes.centre[:, None, None]
        return places

    def _off_floor(self, motion: Motion, cells: YawCells, yaw: Floats, level: float) -> Bools:
        """(N, n) True where some of the footprint is where it must not be."""
        floor, count = self.floor, yaw.shape[1]
        assert floor is not None
        reach = float(np.max(np.linalg.norm(self.footprint.corners, axis=1)))
        centres = np.repeat(motion.boxes.centre[:, :2], count, axis=0)
        gaps = floor.signed_distance(centres, self.footprint, world_yaw(self.arm, yaw.ravel())).reshape(yaw.shape)
        moved = np.linalg.norm(motion.boxes.half[:, :2], axis=1) + reach * 2.0 * np.sin(0.5 * cells.half)
        off: Bools = gaps + moved[:, None] < level - TOLERANCE
        return off

    def _hit(
        self, motion: Motion, places: Floats, moved: Floats, live: Bools, mounted: Bools, levels: dict[int, float]
    ) -> None:
        """Take away the cells in which a point of the base is in an obstacle or in the part."""
        points = self.bodies.base_points
        axis = motion.boxes.centre[:, None] + points.place[:, 2, None] * self.arm.mount[:, 2]
        beside = np.hypot(points.place[:, 0], points.place[:, 1])
        for other in self.bodies.base_others:
            level = levels.get(other.cause, 0.0)
            kept = other.points
            allowance = points.radius[kept] + other.required + level
            counted = ~mounted[:, other.pairs]
            for _, frame in other.frames(self.held.objects, self.held.segments):
                nearest = inside(other.body.shape, frame, axis[:, kept]) - allowance - beside[kept]
                near = np.flatnonzero(np.any((nearest < 0.0) & counted, axis=1) & np.any(live, axis=1))
                if not len(near):
                    continue
                gaps = gap(other.body.shape, frame, places[near][:, :, kept]) - allowance + moved[near][:, :, kept]
                live[near] &= ~np.any((gaps < -TOLERANCE) & counted[near][:, None], axis=2)

    def _hit_itself(self, motion: Motion, places: Floats, moved: Floats, live: Bools, levels: dict[int, float]) -> None:
        """Take away the cells in which a point of the base is in a moving link."""
        capsules, points = self.bodies.capsules, self.bodies.base_points
        for pair in self.bodies.base_pairs:
            link = int(capsules.link[pair.capsule])
            frames = motion.frames[:, :, link]
            ends = capsules.ends[pair.capsule] @ frames[..., :3, :3].swapaxes(-1, -2) + frames[..., None, :3, 3]
            reach = np.hypot(points.place[pair.points, 0], points.place[pair.points, 1])
            allowance = points.radius[pair.points] + capsules.radius[pair.capsule] + pair.required
            allowance = allowance + levels.get(pair.cause, 0.0)
            axis = motion.boxes.centre[:, None] + points.place[pair.points, 2, None] * self.arm.mount[:, 2]
            nearest = np.min(_from_segments(axis[:, None], ends) - reach - allowance, axis=2)
            box, pose = np.nonzero((nearest + motion.shift[:, None] < -TOLERANCE) & np.any(live, axis=1)[:, None])
            if not len(box):
                continue
            links = np.full(len(box), link)
            swung = np.maximum(*(motion.ball(box, pose, ends[box, pose, k], links) for k in (0, 1)))
            near = np.flatnonzero(nearest[box, pose] + motion.shift[box] + swung < -TOLERANCE)
            for at in range(0, len(near), AT_ONCE):
                some = near[at : at + AT_ONCE]
                k = box[some]
                gaps = _from_segments(places[k][:, :, pair.points], ends[k, pose[some]][:, None])
                gaps += moved[k][:, :, pair.points] + swung[some, None, None] - allowance
                np.logical_and.at(live, k, ~np.any(gaps < -TOLERANCE, axis=2))

    def _hit_whole(
        self,
        motion: Motion,
        cells: YawCells,
        yaw: Floats,
        live: Bools,
        mounted: Bools,
        levels: dict[int, float],
        every: bool,
    ) -> None:
        """In small boxes, take away the cheapest cells, or all, in which a whole body of the base hits something."""
        small = np.flatnonzero((np.max(motion.boxes.half, axis=1) < SMALL) & np.any(live, axis=1))
        pairs: dict[int, list[_Near]] = {}
        for box, pair in self._near(motion, small, mounted, levels):
            pairs.setdefault(box, []).append(pair)
        for box, near in pairs.items():
            for cell in np.argsort(np.where(live[box], cells.cost[box], np.inf), kind="stable"):
                if live[box, cell] and self._lost(motion, box, float(yaw[box, cell]), cells.half[box], near):
                    live[box, cell] = False
                elif not every:
                    break  # the cheapest cell that is left decides

    def _lost(self, motion: Motion, box: int, yaw: float, half: float, near: list[_Near], cut: int = 0) -> bool:
        """True if for all yaws [rad] within ``half`` some body hits another; cut in two where that may be so."""
        base = self.arm.base_in_world(motion.boxes.centre[box], yaw)
        shift, swing = float(motion.shift[box]) + TOLERANCE, 2.0 * float(np.sin(0.5 * half))
        maybe = False
        for k, pair in enumerate(near):
            slack = pair.slack(base) + shift
            if slack + swing * pair.radius < 0.0:
                near.insert(0, near.pop(k))
                return True
            maybe |= slack < 0.0
        if not maybe or cut >= CUTS:
            return False
        return all(self._lost(motion, box, yaw + side * 0.5 * half, 0.5 * half, near, cut + 1) for side in (-1.0, 1.0))

    def _near(
        self, motion: Motion, small: Ints, mounted: Bools, levels: dict[int, float]
    ) -> Iterator[tuple[int, _Near]]:
        """Of boxes (k,), the pairs of a base's whole bodies that some yaw may bring too near to each other."""
        if not len(small):
            return
        for solid in self.bodies.base_solids:
            required = solid.required + levels.get(solid.other.cause, 0.0)
            if not np.isfinite(required):
                continue
            places = motion.boxes.centre[small] + solid.body.pose[2, 3] * self.arm.mount[:, 2]
            around = float(np.hypot(*solid.body.pose[:2, 3])) + radius_of(solid.body.shape)
            for _, frame in solid.other.frames(self.held.objects, self.held.segments):
                near = inside(solid.other.body.shape, frame, places) < around + required
                for box in small[near & ~mounted[small, solid.pair]]:
                    yield int(box), _Near(solid, frame, required)


@dataclass(frozen=True, eq=False, slots=True)
class _Near:
    """Two bodies, the second at ``frame`` (4, 4), with ``required`` m between them."""

    solid: SolidPair
    frame: Floats
    required: float

    @property
    def radius(self) -> float:
        """m, the largest distance of the first body from the axis that the base turns about."""
        return axis_distance(self.solid.body)

    def slack(self, base: Floats) -> float:
        """m, what is kept beyond what is required on a base (4, 4)."""
        solid = self.solid
        found = separation(solid.body.shape, base @ solid.body.pose, solid.other.body.shape, self.frame)
        return found.distance - self.required


def _from_segments(points: Floats, ends: Floats) -> Floats:
    """(..., P) m, distances of points (..., P, 3) from segments (..., 2, 3)."""
    start, along = ends[..., None, 0, :], (ends[..., 1, :] - ends[..., 0, :])[..., None, :]
    apart, length = points - start, np.einsum("...a,...a->...", along, along)
    share = np.clip(np.einsum("...a,...a->...", apart, along) / np.maximum(length, 1e-300), 0.0, 1.0)
    apart = apart - share[..., None] * along
    distance: Floats = np.sqrt(np.einsum("...a,...a->...", apart, apart))
    return distance
