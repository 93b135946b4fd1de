"""Rows that bring the arms of a cell together: distances, floor, couplings.

Exact in value and slope where they are made: Coal's distances with their witness points fixed to their bodies, the
joints following the unknowns through the Jacobian.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import Configurations
from duocell.models.collision.contact_gradient import contact_gradients
from duocell.optimizer.nlp.pose_rows import BASE
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.linear_rows import RowCollector
from duocell.optimizer.verification.scene import Scene, world_yaw

NEAR = 0.2
"""m beyond what is required; pairs that are farther apart get no row."""
MOST_ROWS = 240
"""The nearest pairs of a layout that get a row."""
DIFFERENCE = 1e-6
"""m and rad, of the differences of coupling rows."""


def add_contacts(
    rows: RowCollector, scene: Scene, places: Configurations, bases: Floats, margins: Mapping[PairClass, float]
) -> None:
    """The pairs nearest to their required distances.

    Args:
        rows: to add to. scene: the cell. places: its configurations at the samples. bases: (A, 4, 4) in the world.
        margins: m, what to ask for beyond the required distance of a class.
    """
    model = scene.model
    if model is None:
        return
    gaps = model.bounds(places, scene.movable, scene.required + NEAR) - scene.required
    nearest = np.argsort(gaps, axis=None, kind="stable")[:MOST_ROWS]
    at, pairs = np.unravel_index(nearest[gaps.ravel()[nearest] < NEAR], gaps.shape)
    contacts = [model.contact(places, int(k), int(pair)) for k, pair in zip(at, pairs, strict=True)]
    slopes = contact_gradients(model, places, at, contacts, bases)
    values = np.array([contact.distance for contact in contacts])
    wanted = scene.required[pairs] + np.array([margins.get(contact.kind, 0.0) for contact in contacts])
    rows.add_at(at, slopes.bases.reshape(len(at), BASE * len(bases)), slopes.joints, values, wanted)


def add_floor(rows: RowCollector, scene: Scene, points: Sequence[ArmSolution]) -> None:
    """One row per arm: the nearest piece of floor that it must not cover."""
    floor = scene.cell.surroundings.floor
    if floor is None:
        return
    for a, (point, footprint) in enumerate(zip(points, scene.footprints, strict=True)):
        plane = floor.half_plane(point.position[:2], footprint, float(world_yaw(scene.cell.arms[a], point.yaw)))
        if plane is not None:
            row = np.zeros((1, rows.unknowns.count))
            row[0, BASE * a : BASE * a + 2] = plane.normal
            row[0, BASE * a + 3] = plane.yaw_slope
            rows.add(row, np.array([plane.distance]), np.zeros(1))


def add_ties(rows: RowCollector, scene: Scene, points: Sequence[ArmSolution]) -> None:
    """Two rows for every row of a coupling, one per side of its set."""
    place = np.array([[*point.position, point.yaw] for point in points])
    for coupling in scene.cell.couplings:
        here = coupling.rows([*place])
        slopes = np.zeros((len(here.values), rows.unknowns.count))
        for column in range(place.size):
            shift = DIFFERENCE * np.eye(place.size)[column].reshape(place.shape)
            plus, minus = coupling.rows([*(place + shift)]).values, coupling.rows([*(place - shift)]).values
            slopes[:, column] = [float(p - m) / (2.0 * DIFFERENCE) for p, m in zip(plus, minus, strict=True)]
        values = np.array([float(value) for value in here.values])
        for side, bound in ((1.0, np.array(here.lower)), (-1.0, np.array(here.upper))):
            some = np.isfinite(bound)
            rows.add(side * slopes[some], side * values[some], side * bound[some])
