"""Rows that keep every arm inside its own constraints: limits, posture, joint steps, conditioning."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.singular_margins import ELBOW, SHOULDER, margins_along
from duocell.models.kinematics.branches import posture_terms
from duocell.models.kinematics.closed_form import ClosedForm, closed_form
from duocell.models.kinematics.nominal import singular_fifth
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import Signs
from duocell.optimizer.nlp.conditioning_cuts import NUDGE, conditioning_gradients
from duocell.optimizer.nlp.pose_rows import BASE
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.linear_rows import RowCollector
from duocell.optimizer.verification.scene import Scene

NEAR = 0.25
"""rad or m; what is farther from its bound gets no row."""
INSIDE = 1e-7
"""rad or m kept to bounds, for what the linear rows leave out."""
LEFT = 0.1
"""Share of the way to the end of reach that a step leaves."""
REACH = np.square([SHOULDER, ELBOW])
"""m² and 1, squares of front and elbow's sine that remain, but for `Scene.margin_factor`."""
DIFFERENCE = 1e-6
"""rad, of the differences of the posture's terms."""
SINGULAR = 10.0
"""Conditioning numbers are small: a row counts them this many times."""


def add_joint_rows(rows: RowCollector, scene: Scene, index: int, point: ArmSolution) -> None:
    """Add the rows of one arm of a layout."""
    arm = scene.cell.arms[index]
    _add_limits(rows, scene, index, arm)
    _add_steps(rows, scene, index, point)
    form = closed_form(arm.robot)
    if form is not None and point.signs is not None:
        _add_posture(rows, scene, index, form, point.signs)
    singular = singular_fifth(arm.robot) if form is None and arm.avoid_singularities else None
    if singular is not None:
        _add_wrist(rows, scene, index, singular)
    if arm.min_conditioning is not None:
        _add_conditioning(rows, scene, index, arm)


def _add_limits(rows: RowCollector, scene: Scene, index: int, arm: Arm) -> None:
    """Joints near their limits, and sums of joints near linear ones, at and between the poses."""
    bounded = arm.bounded(rows.samples.joints[index])
    for side, margin in ((1.0, bounded - arm.bounded_lower), (-1.0, arm.bounded_upper - bounded)):
        k, i = np.nonzero(margin < NEAR)
        _add(rows, scene, index, k, side * arm.bounded_slopes[i], margin[k, i])


def _add_steps(rows: RowCollector, scene: Scene, index: int, point: ArmSolution) -> None:
    """Steps between consecutive poses of a segment that are near the largest allowed one."""
    poses, most = rows.samples.poses, scene.cell.step_limits(scene.cell.arms[index].robot)
    change = np.diff(point.joints, axis=0)
    j, i = np.nonzero((most - np.abs(change) < NEAR) & scene.cell.task.joined[:, None])
    if len(j):
        unit = -np.sign(change[j, i])[:, None] * np.eye(point.joints.shape[1])[i]
        slopes = rows.through(index, poses[j + 1], unit) - rows.through(index, poses[j], unit)
        rows.add(slopes, most[i] - np.abs(change[j, i]), np.full(len(j), INSIDE))


def _add_posture(rows: RowCollector, scene: Scene, index: int, form: ClosedForm, signs: Signs) -> None:
    """Places near a singular set that the posture must not cross (as in `duocell.optimizer.verification.verify`).

    Front and elbow fall like the square root of the way to the end of reach: their squares are what a row can follow.
    A step that ends there is beyond it by the row's bend, where there is no layout at all: it stops short.
    """
    q, reach = rows.samples.joints[index], scene.margin_factor**2 * REACH
    away = margins_along(scene.cell.arms[index], scene.margin_factor).wrist
    sides = np.array([signs[0], -signs[0] * signs[1], signs[2]])
    values = sides[:, None] * _terms(form, q)
    slopes = np.stack(
        [
            (_terms(form, q + DIFFERENCE * unit) - _terms(form, q - DIFFERENCE * unit)) / (2.0 * DIFFERENCE)
            for unit in np.eye(q.shape[1])
        ],
        axis=-1,
    )
    slopes *= sides[:, None, None]
    k = np.flatnonzero(values[2] < NEAR)
    _add(rows, scene, index, k, slopes[2, k], values[2, k] - np.sin(away))
    t, k = np.nonzero(values[:2] < NEAR)
    size = np.abs(values[t, k])
    margin = values[t, k] * size
    left = reach[t] + LEFT * np.maximum(margin - reach[t], 0.0)
    _add(rows, scene, index, k, 2.0 * size[:, None] * slopes[t, k], margin, left)


def _add_wrist(rows: RowCollector, scene: Scene, index: int, singular: float) -> None:
    """Places at which the wrist of an arm that is not quite as drawn is near its own singularity."""
    fifth = rows.samples.joints[index][:, 4] - singular
    side = np.where(np.sum(np.sin(fifth)) >= 0.0, 1.0, -1.0)
    values, slopes = side * np.sin(fifth), side * np.cos(fifth)
    k = np.flatnonzero(values < NEAR)
    away = margins_along(scene.cell.arms[index], scene.margin_factor).wrist
    _add(rows, scene, index, k, slopes[k, None] * np.eye(6)[4], values[k] - np.sin(away))


def _terms(form: ClosedForm, q: Floats) -> Floats:
    """(3, m) front [m], sines of elbow and wrist."""
    return np.array(posture_terms(form, q.T, np.sin, np.cos))


def _add_conditioning(rows: RowCollector, scene: Scene, index: int, arm: Arm) -> None:
    """Poses whose conditioning is near what the arm must keep."""
    wanted, poses = float(arm.min_conditioning or 0.0), rows.samples.poses
    values, slopes = conditioning_gradients(arm, rows.samples.joints[index][poses])
    j = np.flatnonzero(values < 2.0 * wanted)
    margin = values[j] - wanted * (1.0 + NUDGE)
    _add(rows, scene, index, poses[j], SINGULAR * slopes[j], SINGULAR * margin)


def _add(
    rows: RowCollector,
    scene: Scene,
    index: int,
    at: Ints,
    slopes: Floats,
    values: Floats,
    left: Floats | None = None,
) -> None:
    """Rows of one arm's joints that must stay above zero; above ``left`` if they tell how far the end of reach is."""
    if not len(at):
        return
    arms = scene.cell.arms
    by_joints = [slopes if a == index else np.zeros((len(at), other.dof)) for a, other in enumerate(arms)]
    required = np.full(len(at), INSIDE) if left is None else INSIDE + left
    rows.add_at(at, np.zeros((len(at), BASE * len(arms))), by_joints, values, required, left is not None)
