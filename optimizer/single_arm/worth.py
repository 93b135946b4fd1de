"""Which candidates of a screening are worth a local solve, and in what order."""

from __future__ import annotations

from itertools import zip_longest

import numpy as np

from duocell.optimizer.parameters.local import LocalParameters
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.reduction.screening import Candidate, Screen, improve, mixed, on_whole_task, scored


def worth_solving(found: Screen, problem: ReducedProblem, parameters: LocalParameters) -> list[Candidate]:
    """Candidates with a chance to be the best, improved and scored on the whole task, best first."""
    if not found.candidates:
        return []
    careful, cloud = problem.arm.min_conditioning is not None, found.parameters.cloud
    steps = parameters.careful_steps if careful else parameters.move_steps
    radius = parameters.move * found.spacing
    candidates = found.candidates
    if len(found.problem.positions) < len(problem.positions):
        candidates = sorted(on_whole_task(problem, candidates), key=lambda c: scored(problem, c))
    chosen = mixed(candidates, parameters.moved, parameters.moved_of_a_posture if careful else parameters.moved)
    if all(candidate.violation > 0.0 for candidate in chosen):  # which may never become usable
        chosen += [candidate for candidate in candidates if candidate.violation == 0.0][: parameters.usable_too]
    rest = [c for c in candidates if careful and (c.violation == 0.0 or c not in chosen)]  # which may lose that
    whole = improve(problem, chosen, found.frame, radius, steps, cloud)
    if rest or not np.any(radius > 0.0):  # else they are scored already
        whole = on_whole_task(problem, whole + rest)
    if careful and all(c.violation > 0.0 for c in whole):
        strict = problem.stricter(found.parameters.stricter)  # whatever it costs: the rest is for the local solver
        whole = on_whole_task(problem, improve(strict, whole, found.frame, radius, steps, cloud))
    usable = [c.objective for c in whole if c.violation == 0.0]
    most = parameters.worth * min(usable) if usable else np.inf
    worth = sorted((c for c in whole if scored(problem, c) <= most), key=lambda c: scored(problem, c))
    return _by_turns([c for c in worth if c.violation == 0.0], [c for c in worth if c.violation > 0.0])


def _by_turns(usable: list[Candidate], others: list[Candidate]) -> list[Candidate]:
    """Both lists in order, by turns: others are cheap on paper, and could take up all starts."""
    pairs = zip_longest(usable, others)
    return [candidate for pair in pairs for candidate in pair if candidate is not None]
