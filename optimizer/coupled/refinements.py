"""Which starts of a coupled search are refined, and what becomes of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from duocell.optimizer.coupled.candidates.starts import Start
from duocell.optimizer.coupled.found import SAME_COST, CoupledSearch
from duocell.optimizer.monitoring.events import Started
from duocell.optimizer.monitoring.watch import tell
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.nlp.solve import SolveStatus
from duocell.optimizer.parameters.coupled import COUPLED, CoupledParameters
from duocell.optimizer.settings import Settings
from duocell.optimizer.sqp.nearby import nearby
from duocell.optimizer.sqp.refine import Refined, refine
from duocell.optimizer.verification.scene import LIMITS, Scene


@dataclass(frozen=True, eq=False, slots=True)
class Terms:
    """What a search is given.

    Attributes:
        settings: seed and number of alternatives. deadline: `time.perf_counter` value, soft.
        report: told what is being done and the share of it that is done.
    """

    settings: Settings
    deadline: float
    report: Callable[[str, float], None] = lambda what, share: None

    @property
    def parameters(self) -> CoupledParameters:
        """Of the search of the cell."""
        return self.settings.parameters.coupled

    @property
    def late(self) -> bool:
        """True if the time is over."""
        return time.perf_counter() > self.deadline


def as_it_is(scene: Scene, points: Sequence[ArmSolution], hopeless: float = COUPLED.hopeless) -> Refined:
    """A layout with the full check of its way, which is spared where its poses alone are far from clean."""
    objective = scene.objective(points)
    violation = max(
        scene.tie_violation(points), scene.floor_violation(points), float(scene.contact_violations([points])[0])
    )
    if violation > hopeless:
        return Refined(tuple(points), objective, violation, False, None, 0)
    clearance = scene.certify(points)
    clean = violation <= LIMITS and clearance.clear and clearance.limit_excess <= LIMITS
    short = max((one.required - one.distance for one in clearance.classes if not one.clear), default=violation)
    return Refined(tuple(points), objective, max(violation, short), clean, clearance, 0)


def first_usable(scene: Scene, search: CoupledSearch, starts: Sequence[Start], terms: Terms) -> None:
    """Take over the cheapest of some starts that passes every check as it is."""
    for start in [one for one in starts if one.clean][: terms.parameters.tried]:
        if search.keep(as_it_is(scene, start.points, terms.parameters.hopeless)):
            return


def refine_all(scene: Scene, search: CoupledSearch, starts: Sequence[Start], terms: Terms) -> None:
    """Refine what can lead to something better than what is known, until enough starts in a row did not."""
    idle = terms.parameters.idle if terms.settings.alternatives == 0 else len(starts)
    in_vain = 0
    ends: list[Refined] = []
    clean_ones: list[Refined] = []
    for number, start in enumerate(starts):
        if terms.late:
            search.finished = False
            return
        if in_vain >= idle:
            return
        if not _promising(clean_ones, search, start, terms.parameters):
            continue
        terms.report("refining", number / len(starts))
        known = search.best
        beat = known.objective if known is not None and idle < len(starts) else np.inf
        refined = _refined(scene, search, start, terms, ends, beat)
        search.keep(refined)
        if refined.clean:
            clean_ones.append(refined)
        in_vain = 0 if known is None or _is_better(search, refined, known) else in_vain + 1


def _refined(
    scene: Scene, search: CoupledSearch, start: Start, terms: Terms, ends: list[Refined], beat: float
) -> Refined:
    """Where a start leads, which is noted among the ``ends``; itself where the way down loses what it keeps."""
    search.starts += 1
    refined = refine(scene, start.points, terms.deadline, ends, beat, parameters=terms.settings.parameters.refinement)
    ends.append(refined)
    status = SolveStatus.OPTIMAL if refined.clean else SolveStatus.INFEASIBLE
    tell(Started("", search.starts, status.value, refined.objective if refined.clean else None, refined.rounds))
    worth = search.best is None or start.objective < search.best.objective
    return (
        as_it_is(scene, start.points, terms.parameters.hopeless)
        if not refined.clean and start.clean and worth
        else refined
    )


def _is_better(search: CoupledSearch, refined: Refined, known: Refined) -> bool:
    """True if a refinement led to a best layout that is noticeably cheaper than the one before."""
    return search.best is refined and not refined.objective > (1.0 - SAME_COST) * known.objective


def _promising(refined: Sequence[Refined], search: CoupledSearch, start: Start, parameters: CoupledParameters) -> bool:
    """False for starts that are far worse than the best layout, or next to a refined one that they do not better."""
    if search.best is None:
        return True
    known = any(
        nearby(start.points, one.points, parameters.beside) and start.objective > one.objective for one in refined
    )
    if start.clean:
        return not known and start.objective <= parameters.worth * search.best.objective
    return not known and start.objective < search.best.objective
