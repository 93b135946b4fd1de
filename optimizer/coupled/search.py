"""The search of a coupled cell: uncoupled optima first, then sampled layouts, those that are clean first, refined."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from duocell.models.cell.cell import Cell
from duocell.optimizer.coupled.alternatives import look_elsewhere
from duocell.optimizer.coupled.canonical import CanonicalForm
from duocell.optimizer.coupled.found import CoupledSearch, Told
from duocell.optimizer.coupled.refinements import Terms, as_it_is
from duocell.optimizer.coupled.rounds import search_general, search_reduced, search_short
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.progress.incumbents import layout_found
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.sqp.refine import Refined, refine
from duocell.optimizer.verification.scene import Scene


def search_coupled(
    cell: Cell,
    searches: Sequence[ArmSearch],
    settings: Settings,
    deadline: float,
    report: Callable[[str, float], None] = lambda what, share: None,
    told: Told = layout_found,
) -> CoupledSearch:
    """Find the best layout of arms that something couples.

    Args:
        cell: the cell. searches: of its arms alone, all successful, in order.
        settings: seed and number of alternatives.
        deadline: `time.perf_counter` value, soft.
        report: told what is being done and the share of it that is done.
        told: called with every clean layout.
    """
    form, terms = CanonicalForm.of(cell), Terms(settings, deadline, report)
    search = CoupledSearch(
        told=lambda points, objective, path: told(form.back(points), objective, path if form.is_as_given else None)
    )
    scene = Scene.of(form.cell)
    _search(scene, search, _in_form(form, searches), terms)
    _polish(scene, search, sum(one.objective for one in searches), terms)
    given = scene if form.is_as_given else Scene.of(cell)
    if not form.is_as_given:
        search.found = [_as_given(given, form, one, terms) for one in search.found]
    if search.nearest is not None and not search.found:
        points = form.back(search.nearest.points)
        search.nearest = replace(search.nearest, points=points, clearance=given.certify(points))
    return search


def _search(scene: Scene, search: CoupledSearch, searches: Sequence[ArmSearch], terms: Terms) -> None:
    """The arms' own optima together, then rounds of starts; then alternatives, where they are asked for."""
    optimum = tuple(arm.best for arm in searches if arm.best is not None)
    if search.keep(as_it_is(scene, optimum, terms.parameters.hopeless)) and terms.settings.alternatives == 0:
        return
    problems = [arm.problem for arm in searches if arm.problem is not None]
    if len(problems) < len(searches):
        search_general(scene, search, searches, terms)
        return
    if len(scene.cell.task) > terms.parameters.long:
        search_short(scene, search, problems, optimum, terms)
    if not search.found and search.finished:
        search_reduced(scene, search, problems, optimum, terms)
    if search.found and len(search.found) <= terms.settings.alternatives:
        terms.report("looking for alternatives", 1.0)
        look_elsewhere(scene, search, problems, terms)


def _in_form(form: CanonicalForm, searches: Sequence[ArmSearch]) -> list[ArmSearch]:
    """The searches of the arms as if they had been asked in the canonical form."""
    if form.is_as_given:
        return list(searches)
    best = form.into([one.best for one in searches if one.best is not None])
    found = []
    for number, arm, point in zip(form.order, form.cell.arms, best, strict=True):
        known = searches[number]
        problem = known.problem
        if problem is not None:  # of the robot it was searched with, which may be one that stands for the arm's own
            problem = reduced_problem(form.cell, replace(arm, robot=problem.arm.robot), problem.apart)
        found.append(replace(known, arm=arm, best=point, problem=problem))
    return found


def _polish(scene: Scene, search: CoupledSearch, least: float, terms: Terms) -> None:
    """Bring the best layout and its rivals to the very bottom, so that it does not matter from where they came.

    Args:
        scene: the cell. search: of it. least: E of its arms alone, below which there is nothing. terms: of the search.
    """
    known, parameters = search.best, terms.parameters
    if known is None or known.objective <= least * (1.0 + parameters.precise):
        return
    for one in [found for found in search.found if found.objective <= known.objective * (1.0 + parameters.rivals)]:
        for _ in range(parameters.again):
            if terms.late:
                return
            refined = _to_the_margins(scene, one, terms)
            if not refined.clean or refined.objective >= one.objective:
                break
            gained = one.objective - refined.objective
            search.improve(one, refined)
            one = refined
            if gained <= parameters.still * one.objective:
                break


def _to_the_margins(scene: Scene, known: Refined, terms: Terms) -> Refined:
    """Where a clean layout leads if it may go as near to singular sets as the full check allows, or else not quite.

    Beside a singular wrist joints turn by many times what the wrist does: a quarter of a margin may cost a thousandth.
    """
    refined = _precisely(replace(scene, margin_factor=1.0), known.points, terms)
    return refined if refined.clean else _precisely(scene, known.points, terms)


def _precisely(scene: Scene, points: Sequence[ArmSolution], terms: Terms) -> Refined:
    """Where a layout leads, to the last digits."""
    parameters = terms.settings.parameters
    return refine(scene, points, terms.deadline, worth=parameters.coupled.precise, parameters=parameters.refinement)


def _as_given(scene: Scene, form: CanonicalForm, refined: Refined, terms: Terms) -> Refined:
    """A clean layout of the canonical form as one of the cell as it was given, checked anew."""
    points = form.back(refined.points)
    found = replace(as_it_is(scene, points, terms.parameters.hopeless), rounds=refined.rounds)
    return found if found.clean else _precisely(scene, points, terms)
