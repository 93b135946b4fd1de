"""Rounds of starts, ever more of them: sampled layouts for arms with a reduced problem, combined pools for others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.optimizer.clearance.clearance import PathClearance
from duocell.optimizer.coupled.alternatives import look_elsewhere
from duocell.optimizer.coupled.arms_alone import impossible_alone
from duocell.optimizer.coupled.candidates.followed import Followed
from duocell.optimizer.coupled.candidates.layouts import sample_layouts
from duocell.optimizer.coupled.candidates.polish import polished
from duocell.optimizer.coupled.candidates.short_task import ShortTask
from duocell.optimizer.coupled.candidates.starts import Start, starts_of
from duocell.optimizer.coupled.combinations.combine import combine
from duocell.optimizer.coupled.combinations.pool import pool_of, with_optimum
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.coupled.refinements import Terms, first_usable, refine_all
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.verification.scene import Scene, alone_scene


def search_short(
    scene: Scene,
    search: CoupledSearch,
    problems: Sequence[ReducedProblem],
    optimum: tuple[ArmSolution, ...],
    terms: Terms,
) -> None:
    """Search on some of the poses, and refine what is found there on all of them; on more poses if that fails."""
    for count in terms.parameters.short:
        if len(scene.cell.task) <= count or not search.finished:
            return
        short = ShortTask.of(scene, problems, count)
        inner = CoupledSearch(told=_nobody)
        search_reduced(short.scene, inner, short.short_problems, short.at_poses(optimum), terms)
        if inner.found and len(inner.found) <= terms.settings.alternatives:
            look_elsewhere(short.scene, inner, short.short_problems, terms)
        search.candidates, search.starts = search.candidates + inner.candidates, search.starts + inner.starts
        search.finished = inner.finished
        known = inner.found or [one for one in (inner.nearest,) if one is not None]
        carried = [short.on_whole(one.points) for one in known]
        starts = sorted((one for one in carried if one is not None), key=lambda one: (not one.clean, one.objective))
        _take(scene, search, starts, terms)
        if search.found:
            return


def search_reduced(
    scene: Scene,
    search: CoupledSearch,
    problems: Sequence[ReducedProblem],
    optimum: tuple[ArmSolution, ...],
    terms: Terms,
) -> None:
    """Rounds of samples, ever denser: the first until something is usable, the second for what is best."""
    followed = Followed.of(scene, problems)
    early: list[Start] = []
    rounds = len(terms.parameters.densities)
    for round_ in range(rounds):
        terms.report("sampling layouts", round_ / rounds)
        starts = _sampled(scene, followed, search, round_, terms)
        starts = sorted([*early, *starts], key=lambda start: (not start.clean, start.objective))
        if round_ == 0 and search.found:
            early = starts
            continue
        if round_ == 0:
            search.reasons = impossible_alone(scene, problems, terms.deadline)
            if search.reasons:
                search.proved = True
                return
        if round_ <= 1:
            starts.append(Start(optimum, scene.objective(optimum), np.inf))
        _take(scene, search, starts, terms)
        if (search.found and round_ > 0) or not search.finished:
            return


def _sampled(scene: Scene, followed: Followed, search: CoupledSearch, round_: int, terms: Terms) -> list[Start]:
    """The starts of one round; in the first one few will do if one of them is usable as it is."""
    parameters = terms.parameters
    closely = round_ == len(parameters.densities) - 1
    pairing = parameters.quick if round_ == 0 else parameters.full
    layouts, tried = sample_layouts(
        followed, parameters.densities[round_], terms.settings.seed + round_, pairing, closely, parameters.positions
    )
    search.candidates += tried
    if round_ == 0:
        some = starts_of(followed, layouts, parameters.few, 0, parameters.apart, parameters.measured)
        first_usable(scene, search, some, terms)
        if search.found:
            return some
    elif not closely and scene.model is None and scene.cell.surroundings.floor is None:
        layouts = polished(followed, layouts)
    return starts_of(followed, layouts, parameters.clean, parameters.others, parameters.apart, parameters.measured)


def search_general(scene: Scene, search: CoupledSearch, searches: Sequence[ArmSearch], terms: Terms) -> None:
    """Rounds of combinations of few candidates per arm, looked at closely."""
    parameters, refinement = terms.parameters, terms.settings.parameters.refinement
    for round_ in range(parameters.rounds):
        terms.report("combining candidates", round_ / parameters.rounds)
        pools = []
        for index, arm in enumerate(searches):
            pool = pool_of(scene, index, arm.problem, round_, terms.settings.seed, terms.deadline, refinement)
            if arm.best is not None:
                pool = with_optimum(pool, alone_scene(scene.cell, arm.arm), arm.best, arm.objective)
            pools.append(pool)
            search.candidates += pool.evaluated
        combined = combine(scene, pools, [arm.problem for arm in searches], 2**round_, terms.deadline, refinement)
        starts = [
            Start(one.points, one.objective, one.violation) for one in combined[: parameters.clean + parameters.others]
        ]
        _take(scene, search, starts, terms)
        if search.found or not search.finished:
            return


def _take(scene: Scene, search: CoupledSearch, starts: Sequence[Start], terms: Terms) -> None:
    """The first that is usable as it is, then where they lead."""
    if not search.found:
        first_usable(scene, search, starts, terms)
    refine_all(scene, search, starts, terms)


def _nobody(points: Sequence[ArmSolution], objective: float, path: PathClearance | None) -> None:
    """Layouts of a task that stands for a longer one are no news."""
