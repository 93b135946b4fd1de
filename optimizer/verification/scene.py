"""A coupled cell made ready to be asked: what a layout's path violates, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Rows
from duocell.models.cell.floor import Footprint
from duocell.models.cell.singular_margins import MARGIN_FACTOR
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel, Configurations
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.clearance import PathClearance
from duocell.optimizer.clearance.path_samples import ObjectPath
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.verify import check
from duocell.optimizer.verification.whole_path import check_whole_path

LIMITS = KEPT
"""rad that a joint may stick out of its limits between two poses, as anywhere."""


@dataclass(frozen=True, eq=False, slots=True)
class Scene:
    """A cell with everything that does not depend on the layout.

    Attributes:
        cell: the cell.
        model: bodies and pairs of the classes a clearance is asked for; None where none is.
        required: (P,) m, distance to keep for every pair of the model.
        movable: (P,) True for pairs whose distance depends on the layout.
        path: of the object.
        footprints: per arm, on the floor.
        between: (pose, fraction of the way to the next) of places at which a refinement keeps everything besides those
            that it samples by itself.
        dips: (arm, pose, fraction) near which an arm comes near to a singular set on its way to the next pose.
        margin_factor: how many times the margins to singular sets a refinement keeps, because it sees few places only.
    """

    cell: Cell
    model: CollisionModel | None
    required: Floats
    movable: Bools
    path: ObjectPath
    footprints: tuple[Footprint, ...]
    between: tuple[tuple[int, float], ...] = ()
    dips: tuple[tuple[int, int, float], ...] = ()
    margin_factor: float = MARGIN_FACTOR

    @staticmethod
    def of(cell: Cell, holders: Sequence[Arm] | None = None) -> Scene:
        """Build the models of a cell; ``holders`` are all arms that hold its part, if these are not the cell's."""
        around = cell.surroundings
        model = CollisionModel(cell.arms, around, holders) if around.clearances.any else None
        kinds = model.bodies.kinds if model is not None else ()
        return Scene(
            cell,
            model,
            np.array([around.clearances.required(kind) or 0.0 for kind in kinds]),
            np.array([kind is not PairClass.PART_OBSTACLE for kind in kinds], dtype=np.bool_),
            ObjectPath(cell.task.poses),
            tuple(around.footprint(arm.name) for arm in cell.arms),
        )

    def bases(self, points: Sequence[ArmSolution]) -> Floats:
        """(A, 4, 4) bases in the world."""
        return np.stack([arm.base_in_world(p.position, p.yaw) for arm, p in zip(self.cell.arms, points, strict=True)])

    def objective(self, points: Sequence[ArmSolution]) -> float:
        """The objective of a layout."""
        cell = self.cell
        return sum(objective_of(cell, arm, point.joints) for arm, point in zip(cell.arms, points, strict=True))

    def floor_violation(self, points: Sequence[ArmSolution]) -> float:
        """Largest distance [m] by which a footprint is where it must not be; <= 0 if none is."""
        return float(self.floor_violations([points])[0])

    def floor_violations(self, layouts: Sequence[Sequence[ArmSolution]]) -> Floats:
        """(L,) m, likewise for many layouts."""
        floor = self.cell.surroundings.floor
        if floor is None or not len(layouts):
            return np.zeros(len(layouts))
        violations = []
        for a, (arm, footprint) in enumerate(zip(self.cell.arms, self.footprints, strict=True)):
            places = np.array([points[a].position[:2] for points in layouts])
            turned = world_yaw(arm, np.array([points[a].yaw for points in layouts]))
            violations.append(-floor.signed_distance(places, footprint, turned))
        worst: Floats = np.max(violations, axis=0)
        return worst

    def tie_violation(self, points: Sequence[ArmSolution]) -> float:
        """Largest violation of a coupling row [m or rad]."""
        bases = [(*point.position, point.yaw) for point in points]
        return max((row_violation(coupling.rows(bases)) for coupling in self.cell.couplings), default=0.0)

    def contact_violations(self, layouts: Sequence[Sequence[ArmSolution]]) -> Floats:
        """(L,) m, largest shortfall of a distance at the poses of each layout; 0 where none falls short."""
        model, m = self.model, len(self.cell.task)
        violations: Floats = np.zeros(len(layouts))
        if model is None or not len(layouts):
            return violations
        bases = np.stack([self.bases(points) for points in layouts])
        joints = [np.stack([points[a].joints for points in layouts]) for a in range(len(self.cell.arms))]
        places = model.configure_layouts(bases, joints, self.cell.task.poses, self.cell.task.segment_of)
        margins = (model.bounds(places, self.movable, self.required) - self.required).reshape(len(layouts), m, -1)
        short = np.flatnonzero(np.min(margins, axis=(1, 2), initial=np.inf) < -KEPT)
        if len(short):
            counted = model.counted_layouts(bases[short])
            here = np.where(counted[:, None], margins[short], np.inf).reshape(len(short), -1)
            violations[short] = self._worst(model, places, m * short, here)
        return violations

    def _worst(self, model: CollisionModel, places: Configurations, first: Ints, margins: Floats) -> Floats:
        """(L,) m, largest shortfalls, 0 where there is none or less than `KEPT`.

        Args:
            model: of the cell. places: of all layouts. first: (L,) the place of each layout's first pose.
            margins: (L, m · P) m, lower bounds of what pairs keep beyond what is required; used up.
        """
        least: Floats = np.zeros(len(margins))
        while True:
            nearest = np.argmin(margins, axis=1)
            layouts = np.flatnonzero(margins[np.arange(len(margins)), nearest] < least)
            if not len(layouts):
                return np.where(least < -KEPT, -least, 0.0)
            k, pairs = np.divmod(nearest[layouts], len(self.required))
            gaps = model.distances(places, first[layouts] + k, pairs) - self.required[pairs]
            least[layouts] = np.minimum(least[layouts], gaps)
            margins[layouts, nearest[layouts]] = np.inf

    def certify(self, points: Sequence[ArmSolution]) -> PathClearance:
        """The full check of the path at and between its poses."""
        return check_whole_path(self.cell, self.model, points)

    def usable(self, points: Sequence[ArmSolution]) -> bool:
        """True if every arm passes the independent check of its own part."""
        return all(check(self.cell, arm, point).usable for arm, point in zip(self.cell.arms, points, strict=True))


def world_yaw(arm: Arm, yaw: Floats | float) -> Floats:
    """(...) rad, direction of a base's x axis seen from above, for yaws (...) about the base's own z axis."""
    axis = arm.base_in_world(np.zeros(3), yaw)[..., :2, 0]
    return np.arctan2(axis[..., 1], axis[..., 0])


def row_violation(rows: Rows) -> float:
    """Largest distance of a row's value to its set."""
    pairs = zip(rows.values, rows.lower, rows.upper, strict=True)
    return max(max(low - float(value), float(value) - high, 0.0) for value, low, high in pairs)


def alone_scene(cell: Cell, arm: Arm) -> Scene:
    """The scene of one arm without the others and without couplings; the part is left out where any arm grasps it."""
    return Scene.of(replace(cell, arms=(arm,), couplings=()), holders=cell.arms)


def own_violations(alone: Scene, points: Sequence[ArmSolution]) -> list[float]:
    """Largest shortfall [m] of floor and distances at the poses of each point, as far as one arm alone is concerned."""
    contacts = alone.contact_violations([[point] for point in points])
    return [
        max(alone.floor_violation([point]), float(violation)) for point, violation in zip(points, contacts, strict=True)
    ]
