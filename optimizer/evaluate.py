"""A given layout, scored and verified without optimising: for a user who drags a base, or checks what was built."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from models.arm import Arm, Interval
from models.arrays import Floats
from models.branches import solve_signed
from models.cell import Cell
from models.closed_form import closed_form
from models.collision import CollisionModel
from models.posture import ALL_SIGNS
from optimizer.clearance import PathClearance, check_clearance, found_clearances
from optimizer.faults import arm_faults, coupling_faults, floor_faults, path_faults
from optimizer.layers import best_path
from optimizer.layout import Layout, Outcome, Reason, Search
from optimizer.local import solve_locally
from optimizer.measure import jobs_of, objective_of, path_signs, placed
from optimizer.program import ArmPoint
from optimizer.reasons import explain_general, explain_path, name_jobs
from optimizer.reduced import Paths, ReducedProblem, evaluate, reduced_problem, seen_from
from optimizer.search import search_arm
from optimizer.settings import Settings
from optimizer.verification.way import follow_way
from optimizer.verification.words import way_faults
from optimizer.verify import ArmCheck, check, summarise

SEARCHING = 3.0
"""s, soft limit of what is done for an arm without a reduced problem."""
FOLLOWABLE = 1e-3
"""m and rad; joints that miss their poses by more say nothing about the way between them."""


@dataclass(frozen=True, eq=False, slots=True)
class _Standing:
    """One arm where it stands: its path, or None if it has none; what is wrong; how many postures were looked at."""

    arm: Arm
    point: ArmPoint | None
    check: ArmCheck | None
    reasons: tuple[Reason, ...]
    looked_at: int


def evaluate_layout(cell: Cell, joints: Sequence[Floats | None] | None = None) -> Layout:
    """Score and verify a layout.

    Args:
        cell: every base value is fixed.
        joints: per arm (m, n) rad to be checked as they are, or None for the best path of the best posture.

    Returns:
        A layout, ``feasible`` if it breaks no rule, else ``infeasible`` with a reason for every rule that it breaks.
        Arms that reach all poses have a placement, whatever else they break.

    Raises:
        ValueError: a base value is not fixed.
    """
    started = time.perf_counter()
    if any(not interval.fixed for arm in cell.arms for interval in _intervals(arm)):
        raise ValueError("only a layout whose bases are fixed can be evaluated")
    given = joints or [None] * len(cell.arms)
    standing = [
        _stand(cell, arm) if path is None else _as_given(cell, arm, path)
        for arm, path in zip(cell.arms, given, strict=True)
    ]
    places = [np.array([interval.low for interval in _intervals(arm)]) for arm in cell.arms]
    there = [one for one in standing if _is_there(one)]
    part = cell if len(there) == len(standing) else replace(cell, arms=tuple(one.arm for one in there), couplings=())
    path = _path(part, there, cell.arms)
    reasons = (
        *(reason for one in standing for reason in one.reasons),
        *floor_faults(cell, places),
        *coupling_faults(cell, places),
        *(() if path is None else path_faults(part, path)),
    )
    reasons = tuple(dict.fromkeys(reasons))  # what is wrong with an arm by itself may be met again on the way
    placements = tuple(placed(cell, one.arm, one.point) for one in standing if one.point is not None)
    checks = [one.check for one in standing if one.check is not None]
    complete = len(placements) == len(standing)
    return Layout(
        outcome=Outcome.INFEASIBLE if reasons else Outcome.FEASIBLE,
        objective=sum(placement.objective for placement in placements) if complete else None,
        placements=placements,
        reasons=name_jobs(cell.task, reasons),
        proved=False,
        search=Search(sum(one.looked_at for one in standing), 0, 0, time.perf_counter() - started),
        verification=summarise(checks) if checks else None,
        clearances=() if path is None else found_clearances(path),
        jobs=jobs_of(cell, placements),
    )


def _intervals(arm: Arm) -> tuple[Interval, ...]:
    base = arm.base
    return base.x, base.y, base.z, base.yaw


def _is_there(one: _Standing) -> bool:
    """Whether the arm is at all poses, or near enough for its way between them to mean something."""
    check = one.check
    return check is not None and max(check.position_error, check.orientation_error) <= FOLLOWABLE


def _path(cell: Cell, standing: Sequence[_Standing], holders: Sequence[Arm]) -> PathClearance | None:
    """The check of the whole path of the arms that are there, of all ``holders``, if a clearance is asked for."""
    clearances = cell.surroundings.clearances
    points = [one.point for one in standing if one.point is not None]
    if not clearances.any or not points:
        return None
    bases = np.stack([one.arm.base_in_world(p.position, p.yaw) for one, p in zip(standing, points, strict=True)])
    model = CollisionModel(cell.arms, cell.surroundings, holders)
    return check_clearance(cell, model, clearances, bases, [point.joints for point in points])


# --- one arm ----------------------------------------------------------------------------------------------------------


def _as_given(cell: Cell, arm: Arm, joints: Floats) -> _Standing:
    """An arm with its joints."""
    form = closed_form(arm.robot)
    signs = None if form is None else path_signs(form, joints)
    return _judged(cell, arm, ArmPoint(*_place(arm), joints, signs), 1)


def _stand(cell: Cell, arm: Arm) -> _Standing:
    """An arm on its best path."""
    problem = reduced_problem(cell, arm)
    return _general(cell, arm) if problem is None else _reduced(cell, problem)


def _reduced(cell: Cell, problem: ReducedProblem) -> _Standing:
    """The best usable posture; if there is none, the one that breaks least."""
    arm = problem.arm
    position, _ = _place(arm)
    paths = evaluate(problem, position[None])
    violation, objective = paths.violation[:, 0], paths.objective[:, 0]
    order = np.lexsort((objective, violation))
    candidates = []
    for k in order[violation[order] == 0.0]:
        point = ArmPoint(position, float(paths.yaw[k, 0]), paths.joints[:, k, 0].T, ALL_SIGNS[k])
        candidates.append(_judged(cell, arm, point, len(order)))
        if not candidates[-1].reasons:
            return candidates[-1]
    return candidates[0] if candidates else _nearest(cell, problem, paths, int(order[0]))


def _nearest(cell: Cell, problem: ReducedProblem, paths: Paths, k: int) -> _Standing:
    """An arm without a usable posture: what the one that breaks least breaks."""
    arm = problem.arm
    position, _ = _place(arm)
    joints, signs = paths.joints[:, k, 0].T, ALL_SIGNS[k]
    if paths.missing[k, 0] == 0.0:
        point = ArmPoint(position, float(paths.yaw[k, 0]), joints, signs)
        return _judged(cell, arm, point, len(ALL_SIGNS))
    seen = solve_signed(problem.form, problem.rotations, seen_from(problem, position[None]), np.array([signs]))
    reasons = explain_path(cell, arm, joints, seen.missing[0, 0], "from this base")
    return _Standing(arm, None, None, reasons, len(ALL_SIGNS))


def _general(cell: Cell, arm: Arm) -> _Standing:
    """The cheapest path through the branches; what its samples of a redundant arm leave is got by a local solve.

    Where that ends in nothing usable, the search of an arm with a fixed base has the last word.
    """
    deadline = time.perf_counter() + SEARCHING
    path = best_path(cell, arm, *_place(arm))
    if path.unreached and arm.dof <= 6:  # all branches are known
        return _Standing(arm, None, None, explain_general(cell, arm, [path]), 1)
    found = []
    if not path.unreached:
        point = ArmPoint(path.position, path.yaw, path.joints, path.signs)
        found.append(_judged(cell, arm, point, 1))
        if arm.dof > 6 or found[0].reasons:
            solved = solve_locally(cell, arm, point, deadline)
            if solved.status.has_point:
                found.append(_judged(cell, arm, solved.points[0], 2))
    if not any(one.point is not None and not one.reasons for one in found):
        searched = search_arm(cell, arm, Settings(), deadline)
        if searched.best is not None:
            return _judged(cell, arm, searched.best, searched.candidates)
        if not found:
            return _Standing(arm, None, None, searched.reasons, searched.candidates)
    return min(found, key=lambda one: (bool(one.reasons), _objective(cell, one)))


def _objective(cell: Cell, one: _Standing) -> float:
    """An arm's part of E; infinite without a path."""
    return np.inf if one.point is None else objective_of(cell.task, one.arm, one.point.joints)


def _place(arm: Arm) -> tuple[Floats, float]:
    """Where a fixed base stands: (3,) m, and its yaw [rad]."""
    x, y, z, yaw = (interval.low for interval in _intervals(arm))
    return np.array([x, y, z]), yaw


def _judged(cell: Cell, arm: Arm, point: ArmPoint, looked_at: int) -> _Standing:
    found = check(cell, arm, point)
    reasons = arm_faults(cell, arm, point, found)
    if not reasons:
        way = follow_way(cell, arm, point)
        reasons = way_faults(way.breaks, way.beyond)
    return _Standing(arm, point, found, reasons, looked_at)
