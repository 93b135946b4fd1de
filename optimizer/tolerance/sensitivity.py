"""What a layout is short of, and how fast errors of the bases eat it up: to first order, which says where to look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.collision.contact_gradient import contact_gradients
from duocell.optimizer.nlp.pose_rows import BASE
from duocell.optimizer.tolerance.nominal import Nominal

PAIRS = 24
"""Pairs of bodies with a row: those that come nearest to what is required of them."""


@dataclass(frozen=True, eq=False, slots=True)
class Sensitivity:
    """Rows that must not become negative.

    Attributes:
        margins: (R,) m or rad, of the layout as it should be.
        slopes: (R, A, 4) change by a whole error of each base in x, y, z and yaw.
        joint_margin: rad, smallest margin of a joint that turns that errors leave; infinite if none has limits.
    """

    margins: Floats
    slopes: Floats
    joint_margin: float

    @property
    def worst(self) -> Floats:
        """(R,) the most that errors can take away."""
        taken: Floats = np.sum(np.abs(self.slopes), axis=(1, 2))
        return taken

    @property
    def factors(self) -> Floats:
        """(R,) multiple of the errors at which a row is used up."""
        taken = self.worst
        factors: Floats = np.where(taken > 0.0, self.margins / np.maximum(taken, 1e-300), np.inf)
        return factors


def sensitivity(nominal: Nominal, size: Floats) -> Sensitivity:
    """First-order look at joint limits, joint steps and distances.

    Args:
        nominal: the layout.
        size: (4,) largest error in x, y, z [m] and yaw [rad].
    """
    limits, steps, contacts = _limits(nominal, size), _steps(nominal, size), _contacts(nominal, size)
    margins, slopes = (np.concatenate(rows) for rows in zip(limits, steps, contacts, strict=True))
    joint_margins = (limits[0] - np.sum(np.abs(limits[1]), axis=(1, 2)))[_turning(nominal)]
    return Sensitivity(margins, slopes, float(np.min(joint_margins, initial=np.inf)))


_Rows = tuple[Floats, Floats]
"""Margins (R,) and slopes (R, A, 4)."""


def _limits(nominal: Nominal, size: Floats) -> _Rows:
    """For every limit the pose that comes nearest to it."""
    arms, m = nominal.cell.arms, nominal.poses
    margins, slopes = [np.zeros(0)], [np.zeros((0, len(arms), BASE))]
    for a, arm in enumerate(arms):
        bounded, moves = arm.bounded(nominal.joints[a][:m]), arm.bounded_slopes @ (nominal.follow[a][:m] * size)
        for side, margin in ((1.0, bounded - arm.bounded_lower), (-1.0, arm.bounded_upper - bounded)):
            limited = np.flatnonzero(np.isfinite(margin[0]))
            worst = np.argmin(margin - np.sum(np.abs(moves), axis=2), axis=0)[limited]
            rows = np.zeros((len(limited), len(arms), BASE))
            rows[:, a] = side * moves[worst, limited]
            margins.append(margin[worst, limited])
            slopes.append(rows)
    return np.concatenate(margins), np.concatenate(slopes)


def _turning(nominal: Nominal) -> Bools:
    """(R,) for every limit whether it is one of an angle."""
    found = [np.zeros(0, dtype=np.bool_)]
    for arm in nominal.cell.arms:
        turns = np.array([unit == "rad" for unit in arm.bounded_units])
        found += [turns[np.isfinite(ends)] for ends in (arm.bounded_lower, arm.bounded_upper)]
    return np.concatenate(found)


def _steps(nominal: Nominal, size: Floats) -> _Rows:
    """For every joint the longest step."""
    arms, m = nominal.cell.arms, nominal.poses
    margins, slopes = [np.zeros(0)], [np.zeros((0, len(arms), BASE))]
    for a, arm in enumerate(arms):
        joined = nominal.cell.task.joined
        step = np.diff(nominal.joints[a][:m], axis=0)[joined]
        change = np.diff(nominal.follow[a][:m], axis=0)[joined] * size
        if len(step) == 0:
            continue
        worst = np.argmax(np.abs(step) + np.sum(np.abs(change), axis=2), axis=0)
        joints = np.arange(arm.dof)
        rows = np.zeros((arm.dof, len(arms), BASE))
        rows[:, a] = -np.sign(step[worst, joints])[:, None] * change[worst, joints]
        margins.append(nominal.cell.step_limits(arm.robot) - np.abs(step[worst, joints]))
        slopes.append(rows)
    return np.concatenate(margins), np.concatenate(slopes)


def _contacts(nominal: Nominal, size: Floats) -> _Rows:
    """For every pair that comes near the place where it comes nearest."""
    model, arms = nominal.scene.model, nominal.cell.arms
    if model is None:
        return np.zeros(0), np.zeros((0, len(arms), BASE))
    margins = nominal.gaps - nominal.scene.required
    places = np.argmin(margins, axis=0)
    nearest = np.argsort(margins[places, np.arange(margins.shape[1])], kind="stable")[:PAIRS]
    nearest = nearest[np.isfinite(margins[places[nearest], nearest])]
    at = places[nearest]
    here = model.configure(nominal.bases, nominal.joints, nominal.objects, nominal.segments)
    contacts = [model.contact(here, int(k), int(pair)) for k, pair in zip(at, nearest, strict=True)]
    slopes = contact_gradients(model, here, at, contacts, nominal.bases)
    rows = slopes.bases.copy()
    for a, by_joint in enumerate(slopes.joints):
        rows[:, a] += np.einsum("ri,rib->rb", by_joint, nominal.follow[a][at])
    return np.array([c.distance for c in contacts]) - nominal.scene.required[nearest], rows * size
