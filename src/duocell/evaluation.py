"""A given layout of a cell, scored and verified without optimising."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm, BaseRegion, Interval
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.results.layout import Layout

SLACK = 1e-9
"""m or rad, of the region of a base."""


def evaluate(
    cell: Cell, bases: Mapping[str, ArrayLike] | Layout | None = None, joints: Mapping[str, ArrayLike] | None = None
) -> Layout:
    """Score and verify a layout.

    Args:
        cell: task and arms.
        bases: by name of the arm (4,) x, y, z [m] of the base's origin in the world and its yaw [rad], inside the
            region of that arm; or a layout, whose bases (and joints, unless others are given) are taken. Arms without
            an entry stand where the cell fixes them.
        joints: by name of the arm (m, n) rad to be checked as they are. For arms without an entry the best path of
            the best posture is found.

    Returns:
        A layout: ``feasible`` if it breaks no rule, ``infeasible`` with a reason for every rule that it breaks, and
        ``unknown`` where no path was found that keeps all rules and it is not certain that there is none. Arms that
        reach all poses have a placement, whatever else they break.

    Raises:
        InvalidInput: an arm that the cell does not have, a base that is not fixed or outside its region, joints of
            another shape.
    """
    if isinstance(bases, Layout):
        found = bases.placements
        joints = {placement.arm: placement.joints for placement in found} if joints is None else joints
        bases = {placement.arm: [*placement.position, placement.yaw] for placement in found}
    placed, paths = bases or {}, joints or {}
    names = [arm.name for arm in cell.arms]
    for name in (*placed, *paths):
        if name not in names:
            raise InvalidInput(f"the cell has no arm {name[:80]!r}; its arms are {', '.join(names)}.")
    arms = [_standing(arm, placed.get(arm.name)) for arm in cell.arms]
    given = [_path(cell, arm, paths.get(arm.name)) for arm in arms]
    return evaluate_layout(replace(cell, arms=tuple(arms)), given)


def _standing(arm: Arm, base: ArrayLike | None) -> Arm:
    """The arm at its place."""
    region = arm.base
    if base is None:
        if not all(interval.fixed for interval in (region.x, region.y, region.z, region.yaw)):
            raise InvalidInput(f"the base of {arm.name} is not fixed; say where it stands.")
        return arm
    place = np.asarray(base, dtype=np.float64)
    if place.shape != (4,) or not np.isfinite(place).all():
        raise InvalidInput(f"the base of {arm.name} is four numbers: x, y, z in m and the yaw in rad.")
    x, y, z, yaw = map(float, place)
    for axis, value, allowed in zip("xyz", (x, y, z), (region.x, region.y, region.z), strict=True):
        if not allowed.low - SLACK <= value <= allowed.high + SLACK:
            raise InvalidInput(
                f"the base of {arm.name} stands at {axis} = {value:g} m; its region allows {allowed.low:g} to "
                f"{allowed.high:g} m."
            )
    if region.yaw_outside(yaw) > SLACK:
        raise InvalidInput(f"the base of {arm.name} is turned by {yaw:g} rad, which its region does not allow.")
    return replace(arm, base=BaseRegion(*(Interval(value, value) for value in (x, y, z, yaw))))


def _path(cell: Cell, arm: Arm, joints: ArrayLike | None) -> Floats | None:
    """(m, n) rad, or None."""
    if joints is None:
        return None
    path = np.asarray(joints, dtype=np.float64)
    if path.shape != (len(cell.task), arm.dof) or not np.isfinite(path).all():
        raise InvalidInput(
            f"the joints of {arm.name} are {len(cell.task)} rows (one per pose) of {arm.dof} finite numbers."
        )
    return path
