"""The placement of one arm that comes nearest to being usable, for an answer without a usable one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.layers import LayeredPath
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.reduction.screening import Candidate, on_whole_task
from duocell.optimizer.single_arm.refinement import path_from


def nearest_candidate(problem: ReducedProblem, candidates: Sequence[Candidate]) -> ArmSolution | None:
    """The path that breaks least of the whole task, the cheaper one of two; None where no candidate has one.

    Args:
        problem: the arm on the whole task. candidates: as they were scored on some of the poses.
    """
    seen = [one for one in candidates if np.isfinite(one.violation)]
    if not seen:
        return None
    best = min(on_whole_task(problem, seen), key=lambda one: (one.violation, one.objective))
    return path_from(problem, best.position, best.signs) if np.isfinite(best.violation) else None


def nearest_path(paths: Sequence[LayeredPath]) -> ArmSolution | None:
    """The whole path that breaks least; None where every path lacks a pose."""
    whole = [path for path in paths if len(path.joints)]
    if not whole:
        return None
    best = min(whole, key=lambda path: (path.violation, path.objective))
    return ArmSolution(best.position, best.yaw, best.joints, best.signs)
