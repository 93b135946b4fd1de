"""One arm of a given layout: the paths that it has from where it stands, and what is wrong with them."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import path_signs, solve_signed
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.arm import Arm, Interval
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reasons.faults import arm_faults
from duocell.optimizer.reasons.reasons import explain_general, explain_path
from duocell.optimizer.reduction.layers import best_path
from duocell.optimizer.reduction.reduced import Paths, ReducedProblem, evaluate, reduced_problem, seen_from
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.verify import ArmCheck, check
from duocell.optimizer.verification.words import arm_path_faults

SEARCHING = 3.0
"""s, soft limit of what is done for an arm without a reduced problem."""
FOLLOWABLE = 1e-3
"""m and rad; joints that miss their poses by more say nothing about the way between them."""


@dataclass(frozen=True, eq=False, slots=True)
class Standing:
    """One arm where it stands.

    Attributes:
        arm: the arm.
        point: a path, or None if it has none. check: its figures.
        objective: its part of E; infinite without a path.
        reasons: what is wrong with it.
        looked_at: postures or paths that were looked at.
    """

    arm: Arm
    point: ArmSolution | None
    check: ArmCheck | None
    objective: float
    reasons: tuple[Reason, ...]
    looked_at: int

    @property
    def there(self) -> bool:
        """Whether the arm is at all poses, or near enough for its way between them to mean something."""
        found = self.check
        return found is not None and max(found.position_error, found.orientation_error) <= FOLLOWABLE


@dataclass(frozen=True, eq=False, slots=True)
class Choice:
    """What one arm can do from its base.

    Attributes:
        standings: paths without a fault, cheapest first; or else one, the nearest to that.
        complete: True if there are no others.
    """

    standings: tuple[Standing, ...]
    complete: bool

    @property
    def best(self) -> Standing:
        """The cheapest, or the nearest to being usable."""
        return self.standings[0]


def as_given(cell: Cell, arm: Arm, joints: Floats) -> Choice:
    """An arm with its joints (m, n) [rad]."""
    form = closed_form(arm.robot)
    signs = None if form is None else path_signs(form, joints)
    return Choice((_judged(cell, arm, ArmSolution(*_place(arm), joints, signs), 1),), True)


def choices(cell: Cell, arm: Arm) -> Choice:
    """The paths of an arm with a fixed base: one per posture where it has postures."""
    if not cell.freedom(arm).exact:
        return _searched(cell, arm)
    problem = reduced_problem(cell, arm)
    return _general(cell, arm) if problem is None else _reduced(cell, problem)


def _searched(cell: Cell, arm: Arm) -> Choice:
    """The path that a search finds from the base of an arm whose poses leave something open."""
    found = search_arm(cell, arm, Settings(), time.perf_counter() + SEARCHING)
    point = found.best or found.nearest
    if point is not None:
        return Choice((_judged(cell, arm, point, found.candidates),), False)
    return Choice((Standing(arm, None, None, np.inf, found.reasons, found.candidates),), found.proved)


def _reduced(cell: Cell, problem: ReducedProblem) -> Choice:
    """The usable postures; if there is none, the one that breaks least.

    Turns of 2π move no body: the cheapest ones inside the limits are the only ones that need to be looked at, unless
    linear limits tell turns apart. Where an arm may stand in a singularity, more paths than the closed form's go
    through it.
    """
    arm = problem.arm
    position, _ = _place(arm)
    paths = evaluate(problem, position[None])
    violation, objective = paths.violation[:, 0], paths.objective[:, 0]
    order = np.lexsort((objective, violation > KEPT))
    candidates = []
    for k in order[violation[order] <= KEPT]:
        point = ArmSolution(position, float(paths.yaw[k, 0]), paths.joints[:, k, 0].T, ALL_SIGNS[k])
        candidates.append(_judged(cell, arm, point, len(order)))
    clean = tuple(one for one in candidates if not one.reasons)
    nearest = int(np.argmin(violation))
    return Choice(
        clean or (candidates[0] if candidates else _nearest(cell, problem, paths, nearest),),
        arm.avoid_singularities and not arm.turns_matter,
    )


def _nearest(cell: Cell, problem: ReducedProblem, paths: Paths, k: int) -> Standing:
    """An arm without a usable posture: what the one that breaks least breaks."""
    arm = problem.arm
    position, _ = _place(arm)
    joints, signs = paths.joints[:, k, 0].T, ALL_SIGNS[k]
    if paths.missing[k, 0] == 0.0:
        point = ArmSolution(position, float(paths.yaw[k, 0]), joints, signs)
        return _judged(cell, arm, point, len(ALL_SIGNS))
    seen = solve_signed(problem.form, problem.rotations, seen_from(problem, position[None]), np.array([signs]))
    reasons = explain_path(cell, arm, joints, seen.missing[0, 0], "from this base")
    return Standing(arm, None, None, np.inf, reasons, len(ALL_SIGNS))


def _general(cell: Cell, arm: Arm) -> Choice:
    """The cheapest path through the branches; what its samples of a redundant arm leave is got by a local solve.

    Where that ends in nothing usable, the search of an arm with a fixed base has the last word.
    """
    deadline = time.perf_counter() + SEARCHING
    path = best_path(cell, arm, *_place(arm))
    if path.unreached and not cell.freedom(arm).nullspace(arm.dof):  # all branches are known
        return Choice((Standing(arm, None, None, np.inf, explain_general(cell, arm, [path]), 1),), True)
    found = []
    if not path.unreached:
        point = ArmSolution(path.position, path.yaw, path.joints, path.signs)
        found.append(_judged(cell, arm, point, 1))
        if cell.freedom(arm).nullspace(arm.dof) or found[0].reasons:
            solved = solve_locally(cell, arm, point, deadline)
            if solved.status.has_point:
                found.append(_judged(cell, arm, solved.points[0], 2))
    if not any(one.point is not None and not one.reasons for one in found):
        searched = search_arm(cell, arm, Settings(), deadline)
        if searched.best is not None:
            return Choice((_judged(cell, arm, searched.best, searched.candidates),), False)
        if searched.proved or not found:
            nothing = Standing(arm, None, None, np.inf, searched.reasons, searched.candidates)
            return Choice((nothing,), searched.proved)
    return Choice((min(found, key=lambda one: (bool(one.reasons), one.objective)),), False)


def _place(arm: Arm) -> tuple[Floats, float]:
    """Where a fixed base stands: (3,) m, and its yaw [rad]."""
    x, y, z, yaw = (interval.low for interval in intervals(arm))
    return np.array([x, y, z]), yaw


def _judged(cell: Cell, arm: Arm, point: ArmSolution, looked_at: int) -> Standing:
    found = check(cell, arm, point)
    reasons = arm_faults(cell, arm, point, found)
    if not reasons:
        checked = check_arm_path(cell, arm, point)
        reasons = arm_path_faults(checked.breaks, checked.beyond)
    return Standing(arm, point, found, objective_of(cell, arm, point.joints), reasons, looked_at)


def intervals(arm: Arm) -> tuple[Interval, ...]:
    """x, y, z and yaw of the base."""
    base = arm.base
    return base.x, base.y, base.z, base.yaw
