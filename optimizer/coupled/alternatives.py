"""Layouts in other places or postures than the best one, for whom that does not suit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.coupled.candidates.followed import Followed
from duocell.optimizer.coupled.candidates.layouts import sample_layouts
from duocell.optimizer.coupled.candidates.starts import Start, starts_of
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.coupled.refinements import Terms
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.sqp.nearby import nearby
from duocell.optimizer.sqp.refine import penalty_of, refine
from duocell.optimizer.verification.scene import Scene


def look_elsewhere(scene: Scene, search: CoupledSearch, problems: Sequence[ReducedProblem], terms: Terms) -> None:
    """Look for as many more layouts as are asked for, whatever they cost."""
    wanted, parameters = terms.settings.alternatives, terms.parameters
    apart, refinement = parameters.alternatives_apart, terms.settings.parameters.refinement
    pairing = replace(parameters.full, worth=np.inf)
    starts: list[Start] = []
    for some in (problems, *_in_other_postures(problems, search.found[0].points)):
        followed = Followed.of(scene, some)
        layouts, tried = sample_layouts(followed, 1.0, terms.settings.seed, pairing, positions=parameters.positions)
        starts += starts_of(
            followed, layouts, parameters.elsewhere * wanted, parameters.other_starts, apart, parameters.measured
        )
        search.candidates += tried
    starts.sort(key=lambda start: (not start.clean, start.score(penalty_of(scene.cell, refinement))))
    tried_points: list[Sequence[ArmSolution]] = [one.points for one in search.found]
    for start in starts:
        if len(search.found) > wanted or len(tried_points) > parameters.elsewhere * wanted:
            return
        if terms.late:
            search.finished = False
            return
        if any(nearby(start.points, points, apart) for points in tried_points):
            continue
        search.starts += 1
        refined = refine(scene, start.points, terms.deadline, (), parameters=refinement)
        tried_points += [start.points, refined.points]
        if refined.clean:
            search.keep(refined)


def _in_other_postures(
    problems: Sequence[ReducedProblem], points: Sequence[ArmSolution]
) -> Iterator[list[ReducedProblem]]:
    """The problems with one of the arms in any posture but that of its point."""
    for index, (problem, point) in enumerate(zip(problems, points, strict=True)):
        postures = problem.postures & np.array([signs != point.signs for signs in ALL_SIGNS])
        if np.any(postures):
            yield [*problems[:index], replace(problem, postures=postures), *problems[index + 1 :]]
