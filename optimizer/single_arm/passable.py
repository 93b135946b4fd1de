"""Points whose arm cannot go the whole way, repaired: places where it is stuck become poses that count for nothing.

An optimum is often just at the end of reach, or at a joint limit, at some pose; then the way to the next pose, which
is straight, leaves reach or limits by a little. Added as a pose of weight 0 such a place is a constraint like any pose,
and the optimum moves by as much as is needed.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import replace
from itertools import islice

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.path_samples import ObjectPath
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.verification.arm_path import ArmPathCheck, check_arm_path
from duocell.optimizer.verification.verify import check
from duocell.optimizer.verification.words import arm_path_faults

ROUNDS, FINER = 5, 8
"""Times that places are added, and how much closer to each other each time."""
REPAIRS, NEAR = 4, 1e-3
"""Optima that are repaired, and m and rad within which they are the same."""
NARROWER = 1.5
"""Times by which a joint leaves its limits between the poses that it is kept away from them at the poses, at first."""
MOST_SETTLED = 20
"""Optima that are looked at for one whose joints only overshoot."""
Place = tuple[int, float]
"""The pose before, and the fraction of the way to the next."""


def passable(
    cell: Cell, arm: Arm, point: ArmSolution, met: ArmPathCheck, deadline: float
) -> tuple[float, ArmSolution] | None:
    """A usable point near one that is not passable, all of whose way can be gone.

    Args:
        cell: task.
        arm: the arm.
        point: usable but for its way.
        met: what it meets there.
        deadline: `time.perf_counter` value, soft.

    Returns:
        Its objective and the point, or None if there is none nearby.
    """
    if not cell.freedom(arm).exact and not met.breaks:
        return _with_narrower_limits(cell, arm, point, met, deadline)
    places: set[Place] = set()
    here = point
    for round_ in range(ROUNDS):
        stuck = [(one.pose, one.fraction) for one in met.breaks]
        stuck += [(one.pose, one.fraction) for one in met.excesses]
        found = _around(stuck, float(FINER) ** -round_)
        if found <= places or time.perf_counter() > deadline:
            return None
        places |= found
        finer, rows = with_places(cell, sorted(places))
        free = None if here.free is None else _between(here.free, sorted(places), rows)
        start = replace(here, joints=_between(here.joints, sorted(places), rows), free=free)
        own = next(one for one in finer.arms if one.name == arm.name) if arm.freedom is not None else arm
        solved = solve_locally(finer, own, start, deadline)
        if not solved.status.has_point:
            return None
        there = solved.points[0]
        here = replace(there, joints=there.joints[rows], free=None if there.free is None else there.free[rows])
        if not check(cell, arm, here).usable:
            return None
        met = check_arm_path(cell, arm, here)
        if met.free:
            return objective_of(cell, arm, here.joints), here
    return None


def _with_narrower_limits(
    cell: Cell, arm: Arm, point: ArmSolution, met: ArmPathCheck, deadline: float
) -> tuple[float, ArmSolution] | None:
    """The same where poses leave something open: joints keep as far inside their limits as they leave them between.

    Places between the poses would have parameters of their own, which the path from pose to pose does not have.
    """
    lower, upper, here = arm.lower.copy(), arm.upper.copy(), point
    for round_ in range(ROUNDS):
        for one in met.excesses:
            if one.joint not in arm.robot.joint_names or time.perf_counter() > deadline:
                return None
            joint = arm.robot.joint_names.index(one.joint)
            low = here.joints[one.pose, joint] < 0.5 * (lower[joint] + upper[joint])
            (lower if low else upper)[joint] += (NARROWER + round_) * one.amount * (1.0 if low else -1.0)
        narrow = replace(arm, lower=lower, upper=upper)
        solved = solve_locally(cell, narrow, here, deadline)
        if not solved.status.has_point or not check(cell, arm, solved.points[0]).usable:
            return None
        here = solved.points[0]
        met = check_arm_path(cell, arm, here)
        if met.free:
            return objective_of(cell, arm, here.joints), here
        if met.breaks:
            return None
    return None


def _around(places: list[Place], share: float) -> set[Place]:
    """Places and their neighbours within a share of a step: the arm gets stuck beside a place that it just reaches."""
    offsets = share * np.arange(1 - FINER, FINER) / FINER
    return {(step, float(f)) for step, fraction in places for f in fraction + offsets if 0.0 < f < 1.0}


def with_places(cell: Cell, places: Iterable[Place]) -> tuple[Cell, Ints]:
    """The cell with places between its poses as further poses of weight 0, in order, and where its own poses are."""
    task, pairs = cell.task, list(places)
    steps, fractions = np.array([step for step, _ in pairs]), np.array([fraction for _, fraction in pairs])
    rows = np.arange(len(task)) + np.searchsorted(steps, np.arange(len(task)))
    added = np.ones(len(task) + len(pairs), dtype=np.bool_)
    added[rows] = False
    poses = np.empty((len(added), 4, 4))
    poses[rows], poses[added] = task.poses, ObjectPath(task.poses).at(steps, fractions)
    weights = np.zeros(len(added))
    weights[rows] = task.weights
    starts = tuple(int(rows[start]) for start in task.starts)
    return cell.with_places(Task(poses, starts, task.names, weights), rows, steps, fractions), rows


def _between(joints: Floats, places: list[Place], rows: Ints) -> Floats:
    """Joints (m, n), or other values of the poses, with those of places between the poses, on the chord."""
    fine = np.empty((len(joints) + len(places), joints.shape[1]))
    added = np.ones(len(fine), dtype=np.bool_)
    added[rows] = False
    fine[rows] = joints
    fine[added] = [(1.0 - f) * joints[step] + f * joints[step + 1] for step, f in places]
    return fine


def best_passable(
    cell: Cell, arm: Arm, optima: Iterable[tuple[float, ArmSolution]], known: float, deadline: float
) -> tuple[float, ArmSolution] | None:
    """The best of some usable points whose whole way can be gone, repaired where that is needed.

    Args:
        cell: task.
        arm: the arm.
        optima: objective and point, best first.
        known: only what is better than this counts.
        deadline: `time.perf_counter` value, soft.
    """
    best: tuple[float, ArmSolution] | None = None
    stuck: list[ArmSolution] = []
    for value, point in optima:
        if value >= known or len(stuck) >= REPAIRS:
            break
        if any(_same(point, other) for other in stuck):
            continue
        checked = check_arm_path(cell, arm, point)
        if checked.free:
            return value, point
        stuck.append(point)
        repaired = passable(cell, arm, point, checked, deadline)
        if repaired is not None and repaired[0] < known:
            best, known = repaired, repaired[0]
    return best


def best_tolerable(
    cell: Cell, arm: Arm, optima: Iterable[tuple[float, ArmSolution]]
) -> tuple[float, ArmSolution] | None:
    """The best of some usable points whose joints at most overshoot their limits a little between the poses.

    Args:
        cell: task.
        arm: the arm.
        optima: objective and point, best first.
    """
    looked_at = islice(optima, MOST_SETTLED)
    return next((one for one in looked_at if check_arm_path(cell, arm, one[1]).tolerable), None)


def _same(point: ArmSolution, other: ArmSolution) -> bool:
    """True for points that are all but the same."""
    apart = np.max(np.abs(point.position - other.position)), np.max(np.abs(point.joints - other.joints))
    return point.signs == other.signs and max(apart) < NEAR


def where_stuck(cell: Cell, arm: Arm, optima: list[tuple[float, ArmSolution]]) -> tuple[Reason, ...]:
    """Where the best point gets stuck between its poses, if there are points and none of them gets through."""
    if not optima:
        return ()
    checked = check_arm_path(cell, arm, optima[0][1])
    return arm_path_faults(checked.breaks, checked.beyond)
