"""All tests of one arm over boxes of base positions, the cheap and telling ones first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.collision.collision import CollisionModel
from duocell.models.robot.arm import Arm
from duocell.optimizer.certificate.bounds.angles.joints import Kinematics
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.certificate.exclusion.base_contact import BaseContact
from duocell.optimizer.certificate.exclusion.bodies import ArmBodies, Other, SelfPair
from duocell.optimizer.certificate.exclusion.causes import CONDITIONING, FLOOR, TOLERANCE, YAW, Causes
from duocell.optimizer.certificate.exclusion.conditioning import conditioning_slacks
from duocell.optimizer.certificate.exclusion.motion import Motion, motion
from duocell.optimizer.certificate.exclusion.points import Held, point_slack
from duocell.optimizer.certificate.exclusion.self_contact import self_slack
from duocell.optimizer.certificate.exclusion.yaw_cells import yaw_cells
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.verification.scene import Scene

NO_LEVELS: Mapping[int, float] = {}
ROWS = 1000
"""Poses times boxes tested at once: places of all points of all links are kept for them, few enough for the cache of
the processor (1.3 ms a box in place of 1.7 at ten poses)."""


@dataclass(frozen=True, eq=False, slots=True)
class Exclusion:
    """What the tests say of N boxes.

    Attributes:
        code: (N,) number of the cause that excludes a box; 0 where none does.
        slack: (C, N) by number of the cause: wherever in the box the base stands, no more than this is kept beyond what
            is required; inf where that is not known. A box that is excluded was not looked at any further.
        bound: (N,) lower bound of the cost, raised by the yaws that are lost; inf where the box is excluded.
    """

    code: Ints
    slack: Floats
    bound: Floats


@dataclass(frozen=True, eq=False, slots=True)
class Excluder:
    """The tests of one arm of a cell.

    Attributes:
        arm: the arm. index: its index. model: of the cell; None where no distance is asked for.
        kinematics: of the arm and the task. rules: of the arm. targets: (m, 4, 4) of its flange in the world.
        causes: by number. bodies: of the arm. base: of its base link and footprint.
        held: where the part is. floor: or None. footprint: of the base. hits: exclusions so far, by cause.
    """

    arm: Arm
    index: int
    model: CollisionModel | None
    kinematics: Kinematics
    rules: Rules
    targets: Floats
    causes: Causes
    bodies: ArmBodies
    base: BaseContact
    held: Held
    floor: Floor | None
    footprint: Footprint
    hits: dict[int, int] = field(default_factory=dict)

    @staticmethod
    def of(scene: Scene, index: int, problem: ReducedProblem, kinematics: Kinematics, rules: Rules) -> Excluder:
        """The tests of an arm.

        Args:
            scene: the cell. index: of the arm. problem: its reduced problem on the full task.
            kinematics: of that problem. rules: likewise.
        """
        cell, arm = scene.cell, problem.arm
        causes = Causes.of(arm.robot, scene.model, index)
        bodies = ArmBodies.of(scene.model, index, scene.required, causes)
        held = Held(cell.task.poses, cell.task.segment_of)
        floor, footprint = cell.surroundings.floor, scene.footprints[index]
        base = BaseContact(arm, problem.sigma, bodies, held, floor, footprint)
        targets = cell.flange_targets(arm)
        return Excluder(
            arm, index, scene.model, kinematics, rules, targets, causes, bodies, base, held, floor, footprint
        )

    @property
    def useful(self) -> bool:
        """True if there is anything to test."""
        asked = self.floor is not None or self.arm.min_conditioning is not None
        return asked or bool(self.bodies.others or self.bodies.self_pairs or self.base.useful)

    def moved(self, boxes: Boxes) -> Motion:
        """How the arm moves over boxes."""
        return motion(self.arm, self.kinematics, self.targets, boxes)

    def __call__(
        self,
        boxes: Boxes,
        geometric: Floats,
        cutoff: float,
        levels: Mapping[int, float] = NO_LEVELS,
    ) -> Exclusion:
        """Test boxes.

        Args:
            boxes: N of them.
            geometric: (N,) lower bounds of the cost that know of joints and limits alone.
            cutoff: bounds from here on are of no interest.
            levels: slack below which a box is excluded, by number of the cause, 0 by default; -inf leaves a cause out.
        """
        count = len(boxes)
        found = Exclusion(np.zeros(count, dtype=np.int64), np.full((len(self.causes), count), np.inf), geometric.copy())
        self._note(found, np.arange(count), FLOOR, self._floor_slack(boxes), levels)
        step = max(ROWS // len(self.targets), 1)
        left = np.flatnonzero(found.code == 0)
        for at in range(0, len(left), step):
            self._test(boxes, left[at : at + step], cutoff, levels, found)
        found.bound[found.code > 0] = np.inf
        return found

    def _note(self, found: Exclusion, rows: Ints, cause: int, slack: Floats, levels: Mapping[int, float]) -> None:
        """Note the slack (n,) of rows for a cause, and which of them it excludes."""
        found.slack[cause, rows] = np.fmin(found.slack[cause, rows], slack)
        lost = slack < levels.get(cause, 0.0) - TOLERANCE
        found.code[rows[lost]] = cause
        self.hits[cause] = self.hits.get(cause, 0) + int(np.sum(lost))

    def _test(self, boxes: Boxes, rows: Ints, cutoff: float, levels: Mapping[int, float], found: Exclusion) -> None:
        """Test some of the boxes."""
        moved = self.moved(boxes[rows])
        mounted = self.mounted(moved)
        places = self.bodies.points.placed(moved.frames)
        left = np.arange(len(rows))
        for other in sorted(self.bodies.others, key=lambda other: -self.hits.get(other.cause, 0)):
            check_stop()
            slack = self._keeps_off(moved[left], places[left], other, mounted[left], levels)
            self._note(found, rows[left], other.cause, slack, levels)
            left = np.flatnonzero(found.code[rows] == 0)
        if self.bodies.self_pairs and len(left):
            self._test_links(moved, rows, levels, found)
            left = np.flatnonzero(found.code[rows] == 0)
        if self.arm.min_conditioning is not None and len(left):
            slack = np.min(conditioning_slacks(moved[left], self.arm, self.kinematics.targets.apart), axis=1)
            self._note(found, rows[left], CONDITIONING, slack, levels)
            left = np.flatnonzero(found.code[rows] == 0)
        if self.base.useful and len(left) and levels.get(YAW, 0.0) > -np.inf:
            self._test_yaws(moved[left], rows[left], cutoff, mounted[left], levels, found)

    def mounted(self, moved: Motion) -> Bools:
        """(N, P) True for pairs of the model that may be the base and what it is mounted on."""
        if self.model is None:
            return np.zeros((len(moved), 0), dtype=np.bool_)
        bases = self.arm.base_in_world(moved.boxes.centre, 0.0)
        counted: Bools = self.model.surely_counted(self.index, bases, moved.shift)
        return ~counted

    def _keeps_off(
        self, moved: Motion, places: Floats, other: Other, mounted: Bools, levels: Mapping[int, float]
    ) -> Floats:
        """(N,) m, slack of an obstacle or a body of the part."""
        level = levels.get(other.cause, 0.0)
        if not len(moved) or level == -np.inf:
            return np.full(len(moved), np.inf)
        exempt = mounted[:, other.pairs]
        return point_slack(
            moved, self.bodies.points, places, other, self.held, level, exempt if np.any(exempt) else None
        )

    def _test_links(self, moved: Motion, rows: Ints, levels: Mapping[int, float], found: Exclusion) -> None:
        """Test the links of the arm against each other."""
        by_cause: dict[int, list[SelfPair]] = {}
        for pair in self.bodies.self_pairs:
            by_cause.setdefault(pair.cause, []).append(pair)
        ends = self.bodies.capsules.placed(moved.frames)
        for cause, pairs in by_cause.items():
            left = np.flatnonzero(found.code[rows] == 0)
            level = levels.get(cause, 0.0)
            if len(left) and level > -np.inf:
                slack = self_slack(moved[left], self.bodies.capsules, ends[left], pairs, level)
                self._note(found, rows[left], cause, slack, levels)

    def _test_yaws(
        self,
        moved: Motion,
        rows: Ints,
        cutoff: float,
        mounted: Bools,
        levels: Mapping[int, float],
        found: Exclusion,
    ) -> None:
        """Raise the bounds by the yaws that are lost."""
        bound = found.bound[rows]
        cells = yaw_cells(moved.first, self.rules, cutoff - bound)
        added = cells.least(self.base.live(moved, cells, mounted, dict(levels)))
        found.bound[rows] = bound + added
        found.code[rows[np.isinf(added)]] = YAW
        self.hits[YAW] = self.hits.get(YAW, 0) + int(np.sum(np.isinf(added)))

    def _floor_slack(self, boxes: Boxes) -> Floats:
        """(N,) m, by how much a disc inside of the footprint keeps on the floor at most."""
        if self.floor is None:
            return np.full(len(boxes), np.inf)
        radius, aside = _inner_disc(self.footprint)
        gaps = self.floor.signed_distance(boxes.centre[:, :2], Footprint.disc(radius), 0.0)
        slack: Floats = gaps + aside + np.linalg.norm(boxes.half[:, :2], axis=1)
        return slack


def _inner_disc(footprint: Footprint) -> tuple[float, float]:
    """m, radius of a disc about the origin, and how far it has to be shifted at most to lie in a footprint."""
    corners, radius = footprint.corners, footprint.radius
    if len(corners) == 1:
        depth = radius - float(np.linalg.norm(corners[0]))
    else:
        sides = np.roll(corners, -1, axis=0) - corners
        outward = np.column_stack([sides[:, 1], -sides[:, 0]]) / np.linalg.norm(sides, axis=1)[:, None]
        depth = float(np.min(np.einsum("ka,ka->k", outward, corners))) + radius
    aside = float(np.min(np.linalg.norm(corners, axis=1))) if depth < 0.0 else 0.0
    return max(depth, 0.0), aside
