"""The check of a layout's whole path: every arm followed between the poses, and clearances where any are asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.collision.collision import CollisionModel
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.clearance import LimitExcess, PathClearance, check_clearance
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.arm_path import check_arm_path


def check_whole_path(cell: Cell, model: CollisionModel | None, points: Sequence[ArmSolution]) -> PathClearance:
    """Check a layout at and between its poses.

    Args:
        cell: task and arms.
        model: bodies of the same arms; None where no clearance is asked for.
        points: one per arm, as accurate as `duocell.optimizer.verification.verify` asks for.
    """
    cell = cell.with_parameters([point.free for point in points])
    pairs = list(zip(cell.arms, points, strict=True))
    checks = [check_arm_path(cell, arm, point) for arm, point in pairs]
    breaks = {(one.arm, one.pose): one for check in checks for one in reversed(check.breaks)}
    beyond = [one for check in checks for one in check.excesses]
    nearest = max((_at_poses(arm, point) for arm, point in pairs), key=lambda one: one.amount)
    samples = sum(check.samples for check in checks)
    if model is None:
        worst = max([nearest, *beyond], key=lambda one: one.amount)
        return PathClearance((), tuple(breaks.values()), worst, not breaks, samples)
    bases = np.stack([arm.base_in_world(point.position, point.yaw) for arm, point in pairs])
    found = check_clearance(cell, model, cell.surroundings.clearances, bases, [point.joints for point in points])
    known = {(one.arm, one.pose) for one in found.breaks}
    more = tuple(one for place, one in breaks.items() if place not in known)
    worst = max([found.worst_limit, *beyond], key=lambda one: one.amount)
    return PathClearance(found.classes, (*found.breaks, *more), worst, found.limits_certain and not more, found.samples)


def _at_poses(arm: Arm, point: ArmSolution) -> LimitExcess:
    """The joint nearest to its limits at the poses."""
    excess = arm.limit_excess(point.joints)
    k, i = np.unravel_index(int(np.argmax(excess)), excess.shape)
    return LimitExcess(arm.name, arm.bounded_names[int(i)], int(k), 0.0, float(excess[k, i]), arm.bounded_units[int(i)])
