"""Which candidates of a screening are worth a local solve, and in what order."""

from __future__ import annotations

from itertools import zip_longest

import numpy as np

from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.reduction.screening import STRICTER, Candidate, Screen, improve, mixed, on_whole_task, scored
from duocell.optimizer.single_arm.refinement import CAREFUL_STEPS

WORTH = 1.2
"""Starts scored this much above the best usable one are not worth a solve: screening is precise to a few percent."""
MOVED, MOVE, MOVE_STEPS = 6, 0.25, 3
"""Candidates that are improved on the whole task, within this share of a spacing, in so many steps."""
USABLE_TOO = 2
"""Usable candidates among them where the best ones are not usable."""
MOVED_OF_A_POSTURE = 4
"""Of them no more are of one posture while there are others."""


def worth_solving(found: Screen, problem: ReducedProblem) -> list[Candidate]:
    """Candidates with a chance to be the best, improved and scored on the whole task, best first."""
    if not found.candidates:
        return []
    steps = MOVE_STEPS if problem.arm.min_conditioning is None else CAREFUL_STEPS
    radius = MOVE * found.spacing
    candidates = found.candidates
    if len(found.problem.positions) < len(problem.positions):
        candidates = sorted(on_whole_task(problem, candidates), key=lambda c: scored(problem, c))
    careful = problem.arm.min_conditioning is not None
    chosen = mixed(candidates, MOVED, MOVED_OF_A_POSTURE if careful else MOVED)
    if all(candidate.violation > 0.0 for candidate in chosen):  # which may never become usable
        chosen += [candidate for candidate in candidates if candidate.violation == 0.0][:USABLE_TOO]
    rest = [c for c in candidates if careful and (c.violation == 0.0 or c not in chosen)]  # which may lose that
    whole = improve(problem, chosen, found.frame, radius, steps)
    if rest or not np.any(radius > 0.0):  # else they are scored already
        whole = on_whole_task(problem, whole + rest)
    if problem.arm.min_conditioning is not None and all(c.violation > 0.0 for c in whole):
        strict = problem.stricter(STRICTER)  # whatever it costs: the rest is for the local solver
        whole = on_whole_task(problem, improve(strict, whole, found.frame, radius, CAREFUL_STEPS))
    usable = [c.objective for c in whole if c.violation == 0.0]
    most = WORTH * min(usable) if usable else np.inf
    worth = sorted((c for c in whole if scored(problem, c) <= most), key=lambda c: scored(problem, c))
    return _by_turns([c for c in worth if c.violation == 0.0], [c for c in worth if c.violation > 0.0])


def _by_turns(usable: list[Candidate], others: list[Candidate]) -> list[Candidate]:
    """Both lists in order, by turns: others are cheap on paper, and could take up all starts."""
    pairs = zip_longest(usable, others)
    return [candidate for pair in pairs for candidate in pair if candidate is not None]
