"""Linear rows that stand for distances, joint limits between the poses, and the floor around one layout.

Every row says ``value + gradient · Δ >= required``, exact in value and slope where it was made: Coal's distance with
its witness points fixed to their bodies, the joints following the bases through the Jacobian. The unknowns of a row are
the bases of all arms and, for redundant arms, whose joints do not follow from their bases alone, their joints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.arrays import Floats, Ints
from models.cell import Cell
from models.collision import Configurations
from models.contact_gradient import contact_gradients
from models.surroundings import PairClass
from optimizer.coupled.samples import Samples, sample_path
from optimizer.coupled.scene import Scene, world_yaw
from optimizer.coupled.sensitivity import joints_by_base
from optimizer.pose_rows import BASE
from optimizer.program import ArmPoint

NEAR = 0.2
"""m beyond what is required; pairs that are farther apart get no row."""
NEAR_LIMIT = 0.1
"""rad; likewise for joint limits between the poses."""
MOST_ROWS = 240
"""The nearest pairs of a layout that get a row."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Where the unknowns of the rows are: four per base, then the joints of redundant arms, pose by pose.

    Attributes:
        first_joint: per arm, the column of its first joint; None where the joints follow from the base.
        count: of all columns.
    """

    first_joint: tuple[int | None, ...]
    count: int

    @staticmethod
    def of(cell: Cell) -> Columns:
        """The columns of a cell."""
        first: list[int | None] = []
        count = BASE * len(cell.arms)
        for arm in cell.arms:
            first.append(count if arm.dof > 6 else None)
            count += arm.dof * len(cell.task) if arm.dof > 6 else 0
        return Columns(tuple(first), count)


@dataclass(frozen=True, eq=False, slots=True)
class LinearRows:
    """K rows ``values + gradients · Δ >= required``.

    Attributes:
        gradients: (K, C). values: (K,) m or rad. required: (K,).
    """

    gradients: Floats
    values: Floats
    required: Floats

    @property
    def lack(self) -> float:
        """The largest shortfall; <= 0 if every row holds."""
        return float(np.max(self.required - self.values, initial=-np.inf))


@dataclass(frozen=True, eq=False, slots=True)
class Look:
    """What a layout is like, and what its neighbourhood is like to first order.

    Attributes:
        points: one per arm. objective: E. lack: the largest violation of anything [m or rad], <= 0 if there is none.
        rows: of what is near. followed: False where an arm cannot follow the object between the poses.
    """

    points: tuple[ArmPoint, ...]
    objective: float
    lack: float
    rows: LinearRows
    followed: bool


def look(scene: Scene, points: Sequence[ArmPoint], cushions: Mapping[PairClass, float]) -> Look:
    """Measure a layout and linearise what is near to be violated.

    Args:
        scene: the cell. points: one per arm.
        cushions: m, what to ask for beyond the required distance of a class.
    """
    bases = scene.bases(points)
    columns = Columns.of(scene.cell)
    samples = sample_path(scene.cell, scene.path, bases, points)
    follow = [
        joints_by_base(arm.robot, base[:3, :3], q)
        for arm, base, q in zip(scene.cell.arms, bases, samples.joints, strict=True)
    ]
    builder = _Builder(scene, columns, samples, follow)
    builder.add_limits()
    builder.add_floor(points)
    if scene.model is not None:
        places = scene.model.configure(bases, samples.joints, samples.objects, samples.jobs)
        builder.add_contacts(places, bases, cushions)
    rows = builder.rows()
    lack = max(rows.lack, scene.tie_lack(points))
    return Look(tuple(points), scene.objective(points), lack, rows, samples.followed)


class _Builder:
    """Collects rows."""

    def __init__(self, scene: Scene, columns: Columns, samples: Samples, follow: Sequence[Floats]) -> None:
        self.scene, self.columns, self.samples, self.follow = scene, columns, samples, follow
        self._gradients: list[Floats] = []
        self._values: list[Floats] = []
        self._required: list[Floats] = []

    def rows(self) -> LinearRows:
        """What was collected."""
        nothing = np.zeros(0)
        return LinearRows(
            np.concatenate([np.zeros((0, self.columns.count)), *self._gradients]),
            np.concatenate([nothing, *self._values]),
            np.concatenate([nothing, *self._required]),
        )

    def add_contacts(self, places: Configurations, bases: Floats, cushions: Mapping[PairClass, float]) -> None:
        """Rows of the pairs nearest to their required distances."""
        model, scene = self.scene.model, self.scene
        if model is None:
            return
        spare = model.bounds(places, scene.movable) - scene.required
        nearest = np.argsort(spare, axis=None, kind="stable")[:MOST_ROWS]
        at, pairs = np.unravel_index(nearest[spare.ravel()[nearest] < NEAR], spare.shape)
        contacts = [model.contact(places, int(k), int(pair)) for k, pair in zip(at, pairs, strict=True)]
        slopes = contact_gradients(model, places, at, contacts, bases)
        values = np.array([contact.distance for contact in contacts])
        wanted = scene.required[pairs] + np.array([cushions.get(contact.kind, 0.0) for contact in contacts])
        self._add(at, slopes.bases.reshape(len(at), BASE * len(bases)), slopes.joints, values, wanted)

    def add_limits(self) -> None:
        """Rows of joints that are near their limits between two poses; at the poses their bounds hold anyway."""
        arms = self.scene.cell.arms
        between = np.flatnonzero((self.samples.fraction > 0.0) & (self.samples.fraction < 1.0))
        for a, arm in enumerate(arms):
            q = self.samples.joints[a][between]
            for side, margin in ((1.0, q - arm.lower), (-1.0, arm.upper - q)):
                k, i = np.nonzero(margin < NEAR_LIMIT)
                units = [np.zeros((len(k), other.dof)) for other in arms]
                units[a][np.arange(len(k)), i] = side
                self._add(between[k], np.zeros((len(k), BASE * len(arms))), units, margin[k, i], np.zeros(len(k)))

    def add_floor(self, points: Sequence[ArmPoint]) -> None:
        """One row per arm: the nearest piece of floor that it must not cover."""
        floor = self.scene.cell.surroundings.floor
        if floor is None:
            return
        for a, (point, footprint) in enumerate(zip(points, self.scene.footprints, strict=True)):
            plane = floor.half_plane(
                point.position[:2], footprint, float(world_yaw(self.scene.cell.arms[a], point.yaw))
            )
            if plane is not None:
                row = np.zeros(self.columns.count)
                row[BASE * a : BASE * a + 2] = plane.normal
                row[BASE * a + 3] = plane.yaw_slope
                self._append(row[None], np.array([plane.distance]), np.zeros(1))

    def _add(self, at: Ints, by_base: Floats, by_joints: Sequence[Floats], values: Floats, required: Floats) -> None:
        """Rows of samples (k,) from the derivatives by bases (k, 4A) and, per arm, by joints (k, n)."""
        rows = np.zeros((len(at), self.columns.count))
        rows[:, : by_base.shape[1]] = by_base
        step, fraction = self.samples.step[at], self.samples.fraction[at]
        for a, slopes in enumerate(by_joints):
            first, n = self.columns.first_joint[a], slopes.shape[1]
            if first is None:
                rows[:, BASE * a : BASE * (a + 1)] += np.einsum("ki,kib->kb", slopes, self.follow[a][at])
            else:  # between two poses the joints are, to first order, between theirs
                for pose, share in ((step, 1.0 - fraction), (step + 1, fraction)):
                    places = first + pose[:, None] * n + np.arange(n)
                    rows[np.arange(len(at))[:, None], places] += share[:, None] * slopes
        self._append(rows, values, required)

    def _append(self, rows: Floats, values: Floats, required: Floats) -> None:
        self._gradients.append(rows)
        self._values.append(values)
        self._required.append(required)


def joint_columns(cell: Cell, starts: Sequence[int]) -> Ints:
    """(C,) unknowns of the columns; ``starts`` are the places of the arms' bases among the unknowns of the program."""
    parts = [np.arange(start, start + BASE) for start in starts]
    for arm, start in zip(cell.arms, starts, strict=True):
        if arm.dof > 6:
            parts.append(np.arange(start + BASE, start + BASE + arm.dof * len(cell.task)))
    return np.concatenate(parts)
