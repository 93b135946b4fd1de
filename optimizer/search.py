"""Search of one arm: screen the allowed bases, solve locally from the best distinct ones, keep the best answer."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from models.arm import Arm
from models.cell import Cell
from optimizer.box import search_box
from optimizer.general import screen_general
from optimizer.layout import Reason
from optimizer.local import solve_locally
from optimizer.program import ArmPoint
from optimizer.reasons import explain_general, explain_reach, explain_reduced
from optimizer.reduced import ReducedProblem, evaluate_signed, reduced_problem
from optimizer.screening import Candidate, Screen, screen
from optimizer.settings import Settings
from optimizer.verify import check

STARTS = 4
"""Local solves of an arm with a reduced problem."""
GENERAL_STARTS = 10
"""Local solves of an arm without one: its branches are only sampled."""
WORTH = 1.2
"""Starts scored this much above the best usable one are not worth a solve: screening is precise to a few percent."""
LONG_TASK = 200
"""Poses from which on only half as many starts are solved."""


@dataclass(eq=False, slots=True)
class ArmSearch:
    """What was found for one arm.

    Attributes:
        arm: the arm.
        best: best usable point, or None.
        objective: E there; infinite without a point.
        candidates: bases × postures looked at. starts: local solves.
        basins: how often each distinct local optimum was reached, best first: (objective, hits).
        finished: False if time ran out.
        reasons: why there is no point. proved: True if that is certain.
        problem: the reduced problem, for a certificate; None for arms without one.
    """

    arm: Arm
    best: ArmPoint | None = None
    objective: float = np.inf
    candidates: int = 0
    starts: int = 0
    basins: list[tuple[float, int]] = field(default_factory=list)
    finished: bool = True
    reasons: tuple[Reason, ...] = ()
    proved: bool = False
    problem: ReducedProblem | None = None


def search_arm(cell: Cell, arm: Arm, settings: Settings, deadline: float) -> ArmSearch:
    """Find the best placement of one arm that nothing couples to others."""
    search = ArmSearch(arm, problem=reduced_problem(cell, arm))
    box = search_box(cell, arm)
    if np.any(box[:, 0] > box[:, 1]):
        search.reasons, search.proved = explain_reach(cell, arm), True
        return search
    if search.problem is not None:
        found = screen(search.problem, box, settings.seed)
        search.candidates = found.evaluated
        starts = [_start(search.problem, candidate) for candidate in _worth_solving(found, search.problem)]
        _solve_all(cell, search, starts, deadline)
        if search.best is None and search.finished:
            search.reasons = explain_reduced(cell, search.problem, box, found.candidates, settings.seed)
    else:
        general = screen_general(cell, arm, box, settings.seed)
        search.candidates = general.evaluated
        paths = [path for path in general.paths if len(path.joints)][:GENERAL_STARTS]
        _solve_all(cell, search, [ArmPoint(p.position, p.yaw, p.joints) for p in paths], deadline)
        if search.best is None and search.finished:
            search.reasons = explain_general(cell, arm, general.paths)
    if search.best is None and not search.finished:
        detail = f"{arm.name}: the time limit was reached before a usable base was found; allow more time"
        search.reasons = (Reason(arm.name, "limit_reached", (), detail),)
    return search


def _worth_solving(found: Screen, problem: ReducedProblem) -> list[Candidate]:
    """The candidates to solve from: the best, then others with a chance to be better, in other basins first."""
    poses = len(problem.positions)
    most = STARTS if poses < LONG_TASK else STARTS // 2
    usable = [c.objective for c in found.candidates if c.violation == 0.0]
    worth = [c for c in found.candidates if not usable or c.score(poses) <= WORTH * min(usable)]
    first_of_posture = [c for i, c in enumerate(worth) if all(c.signs != other.signs for other in worth[:i])]
    rest = [c for c in worth if c not in first_of_posture]
    return (first_of_posture + rest)[: most if usable else 2 * most]


def _start(problem: ReducedProblem, candidate: Candidate) -> ArmPoint:
    """The whole path of a candidate."""
    paths = evaluate_signed(problem, candidate.position[None, :], np.array([candidate.signs]))
    return ArmPoint(candidate.position, float(paths.yaw[0, 0]), paths.joints[:, 0, 0].T, candidate.signs)


def _solve_all(cell: Cell, search: ArmSearch, starts: list[ArmPoint], deadline: float) -> None:
    """Solve from every start and keep the best point that passes the independent check."""
    optima: list[tuple[float, ArmPoint]] = []
    for start in starts:
        if time.perf_counter() > deadline:
            search.finished = False
            break
        result = solve_locally(cell, search.arm, start, deadline)
        search.starts += 1
        point = result.points[0]
        if result.status.has_point and check(cell, search.arm, point).usable:
            optima.append((result.objective, point))
    optima.sort(key=lambda optimum: optimum[0])
    search.basins = _basins(optima)
    if optima:
        search.objective, search.best = optima[0]


def _basins(optima: list[tuple[float, ArmPoint]]) -> list[tuple[float, int]]:
    """Distinct optima and how often each was reached: same posture, cost within 1e-5, base within a millimetre."""
    groups: list[tuple[float, ArmPoint, int]] = []
    for objective, point in optima:
        for index, (value, other, hits) in enumerate(groups):
            if (
                point.signs == other.signs
                and abs(objective - value) <= 1e-5 * max(1.0, value)
                and bool(np.all(np.abs(point.position - other.position) < 1e-3))
            ):
                groups[index] = (value, other, hits + 1)
                break
        else:
            groups.append((objective, point, 1))
    return [(value, hits) for value, _, hits in groups]
