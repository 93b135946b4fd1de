"""The search of an arm whose poses leave something open (docs/method.md, section 4.2).

A roll about the axis of the last joint is the search of given poses. Else bases are screened on samples of what is
open, with a shortest path through these layers, and the best of them solved with the parameters as unknowns. Where all
that is open is small, the optima of the nominal poses are the starts.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.difference import ROUNDED, Difference
from duocell.models.robot.arm import Arm
from duocell.optimizer.monitoring.events import Screened
from duocell.optimizer.monitoring.watch import tell
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reasons.reasons import explain_reach
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.reduced import ReducedProblem, reduced_problem
from duocell.optimizer.reduction.screening import scored
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.local import solved_from
from duocell.optimizer.single_arm.open_poses.base_screening import best_start_about, screen_open, start_of
from duocell.optimizer.single_arm.open_poses.sampled_paths import SampledTask
from duocell.optimizer.single_arm.open_poses.symmetric_tool import SymmetricTool
from duocell.optimizer.single_arm.optima import keep_best
from duocell.optimizer.verification.verify import check

ROUNDS, STARTS, AGAIN = 3, 5, 2
"""Rounds while nothing usable is found, local solves of each, and how often it is looked for better choices at the
best base."""
WORTH = 2.0
"""A candidate is not solved that costs so many times the best optimum; solves take off much of what samples cost."""
NEARBY = 0.5
"""Share of a spacing about an optimum in which better choices are looked for."""
LEVEL = 1e-3
"""Relative; what is better by less is not worth another solve."""
WIDEST_TURN, WIDEST_SHIFT = 0.6, 0.3
"""rad and m; a box that is wider bounds nothing."""

SearchGiven = Callable[[Cell, Arm, Settings, float], ArmSearch]
"""The search of an arm whose poses are given."""


def search_open(cell: Cell, arm: Arm, settings: Settings, deadline: float, search_given: SearchGiven) -> ArmSearch:
    """Find the best placement of one arm, whose poses leave something open, that nothing couples to others."""
    search, box, tool = ArmSearch(arm, settings.parameters), search_box(cell, arm), SymmetricTool.of(cell, arm)
    if np.any(box[:, 0] > box[:, 1]):
        search.reasons, search.proved = explain_reach(cell, arm), True
        return search
    if tool is not None and tool.whole:
        _search_symmetric(search, tool, settings, deadline, search_given)
        if search.best is not None or search.proved:
            return search
    problem = reduced_problem(cell, arm)
    _choose_bound(cell, search, problem, tool)
    if problem is not None:
        _search_sampled(cell, search, problem, box, settings, deadline, search_given)
    else:
        _search_from_nominal(cell, search, settings, deadline, search_given)
    if search.best is None and not search.finished:
        detail = f"{arm.name}: the time limit was reached before a usable base was found; allow more time"
        search.reasons = (Reason(arm.name, "limit_reached", (), detail),)
    elif search.best is None:
        detail = (
            f"{arm.name}: no usable base was found among {search.candidates} places and postures and {search.starts} "
            "local solves; it is not proved that there is none. Allow a wider tolerance or base region"
        )
        search.reasons = (Reason(arm.name, "not_found", (), detail),)
    return search


def _search_symmetric(
    search: ArmSearch, tool: SymmetricTool, settings: Settings, deadline: float, search_given: SearchGiven
) -> None:
    """The search of given poses with a last joint that costs nothing, taken over to the arm that was asked about."""
    given = search_given(tool.cell, tool.arm, settings, deadline)
    search.candidates, search.starts, search.finished = given.candidates, given.starts, given.finished
    search.problem, search.tree, search.lift = given.problem, given.tree, tool.lifted
    best = [] if given.best is None else [(given.objective, given.best)]
    lifted = [tool.lifted(point) for _, point in best + given.optima]
    usable = [point for point in lifted if check(tool.true_cell, search.arm, point).usable]
    optima = [(objective_of(tool.true_cell, search.arm, point.joints), point) for point in usable]
    keep_best(tool.true_cell, search, optima, deadline)
    if search.best is None and given.proved:
        search.proved, search.reasons = True, given.reasons


def _choose_bound(cell: Cell, search: ArmSearch, problem: ReducedProblem | None, tool: SymmetricTool | None) -> None:
    """What a certificate may bound: a problem whose answers cost no more than those of the poses with what is open."""
    arm, freedom = search.arm, cell.freedom(search.arm)
    search.lift = lambda point: replace(point, free=freedom.nominal)
    if tool is not None:
        search.problem = reduced_problem(tool.cell, tool.arm)
        search.lift = tool.lifted
        return
    form = closed_form(arm.robot)
    if problem is not None and form is not None:
        angle = float(np.max(freedom.turned())) * ROUNDED
        position = float(np.max(freedom.moved(np.zeros(3)))) * ROUNDED
        wrist = float(np.max(freedom.moved(form.wrist_in_flange))) * ROUNDED
        if angle <= WIDEST_TURN and max(position, wrist) <= WIDEST_SHIFT:
            search.problem = replace(problem, apart=Difference(position=position, wrist=wrist, angle=angle))
            return
    if problem is not None:
        search.no_proof = (
            f"no proof is offered for this arm: its poses leave open {', '.join(freedom.names)}, and there is no lower "
            "bound for ranges so wide"
        )


def _search_sampled(
    cell: Cell,
    search: ArmSearch,
    problem: ReducedProblem,
    box: Floats,
    settings: Settings,
    deadline: float,
    search_given: SearchGiven,
) -> None:
    """Rounds of screening on samples and local solves until something usable is found."""
    arm = search.arm
    whole = SampledTask.of(cell, arm, problem, np.arange(len(cell.task)), coarse=False)
    if whole.samples.count == 1:
        _search_from_nominal(cell, search, settings, deadline, search_given)
        if search.best is not None or not search.finished:
            return
    for round_ in range(ROUNDS if np.any(box[:, 1] > box[:, 0]) else 1):
        found = screen_open(cell, arm, problem, box, settings.seed, round_)
        search.candidates += found.evaluated
        usable = [c.objective for c in found.candidates if c.violation == 0.0]
        tell(Screened(arm.name, search.candidates, len(usable), min(usable, default=None)))
        optima: list[tuple[float, ArmSolution]] = []
        for candidate in found.candidates[:STARTS]:
            known = min((value for value, _ in optima), default=np.inf)
            if scored(whole.problem, candidate) > WORTH * known or time.perf_counter() > deadline:
                break
            optima += solved_from(cell, search, start_of(cell, arm, whole, candidate), deadline)
        search.finished &= time.perf_counter() < deadline
        optima += _chosen_anew(cell, search, whole, optima, (box, found.spacing), deadline)
        keep_best(cell, search, optima, deadline)
        if search.best is not None or not search.finished:
            break


def _chosen_anew(
    cell: Cell,
    search: ArmSearch,
    task: SampledTask,
    optima: list[tuple[float, ArmSolution]],
    place: tuple[Floats, Floats],
    deadline: float,
) -> list[tuple[float, ArmSolution]]:
    """What is reached with other choices from where the best optimum stands, in any posture, and from about it.

    ``place`` is the box of bases (3, 2) and the spacing (3,) of those that were looked at, m.
    """
    more: list[tuple[float, ArmSolution]] = []
    box, spacing = place
    for _ in range(AGAIN):
        if not optima or time.perf_counter() > deadline:
            break
        value, best = min(optima + more, key=lambda optimum: optimum[0])
        score, start = best_start_about(cell, search.arm, task, best, box, NEARBY * spacing)
        found = solved_from(cell, search, start, deadline) if score < (1.0 - LEVEL) * value else []
        more += found
        if not any(one[0] < (1.0 - LEVEL) * value for one in found):
            break
    return more


def _search_from_nominal(
    cell: Cell, search: ArmSearch, settings: Settings, deadline: float, search_given: SearchGiven
) -> None:
    """The optima of the nominal poses, each solved on with what is open."""
    freedom, arm = cell.freedom(search.arm), search.arm
    given = None if arm.freedom is None or not np.any(freedom.given) else arm.freedom.fixed(freedom.given)
    stand_in = replace(arm, freedom=given)
    nominal_cell = replace(cell, arms=tuple(stand_in if one is arm else one for one in cell.arms))
    found = search_given(nominal_cell, stand_in, settings, deadline)
    search.candidates += found.candidates
    search.starts += found.starts
    search.finished &= found.finished
    best = [] if found.best is None else [(found.objective, found.best)]
    starts = [replace(point, free=freedom.nominal) for _, point in best + found.optima]
    optima = [(objective_of(cell, arm, p.joints), p) for p in starts if check(cell, arm, p).usable]
    for start in starts[: STARTS + 1]:
        optima += solved_from(cell, search, start, deadline)
    keep_best(cell, search, optima, deadline)
