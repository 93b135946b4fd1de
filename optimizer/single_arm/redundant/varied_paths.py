"""Usable paths from many different bases, for a search that has to find room for them.

The best base of an arm by itself may stand in an obstacle. So seeds keep the bases from which they first reached the
task, and only their joints are solved for; beside them stand the best candidates of the arm's own search.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.parameters.unreduced import PARAMETERS, UnreducedParameters
from duocell.optimizer.reduction.layers import LayeredPath, finish_path
from duocell.optimizer.single_arm.continuation import continue_paths
from duocell.optimizer.single_arm.redundant.gauss_newton import Iterations, gauss_newton
from duocell.optimizer.single_arm.redundant.ranking import best_windings, figures
from duocell.optimizer.single_arm.redundant.stages import first_seeds, middle_problem, spread, staged, through
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, unreduced_problem

INSIDE = 5e-3
"""rad by which limits and steps are narrowed, so that soft limits are kept by what the task leaves."""
CONDITIONED = 4
"""Iterations in which self-motion is drawn to the conditioning asked for, if any is: dear, an SVD per joint."""
EXACT = 1e-7
"""m and rad, largest error of a path that counts as on the task."""
ENOUGH = 30
"""Usable paths; with fewer, random postures are followed as well."""
FOLLOWED, FOLLOWED_LONG, LONG_TASK = 256, 64, 100
"""Random postures followed, and how many along a task of so many poses."""


@dataclass(frozen=True, eq=False, slots=True)
class VariedPaths:
    """Paths, those that respect all limits first, then by objective, and how many seeds were looked at."""

    paths: list[LayeredPath]
    evaluated: int


def varied_paths(
    cell: Cell,
    arm: Arm,
    box: Floats,
    seed: int,
    deadline: float = np.inf,
    parameters: UnreducedParameters = PARAMETERS,
) -> VariedPaths:
    """Paths of one arm from bases all over the box.

    Args:
        cell: task and step limit. arm: the arm. box: (3, 2) m from `duocell.optimizer.reduction.box.search_box`.
        seed: of the draws. deadline: `time.perf_counter` value, soft.
        parameters: of the stages.
    """
    problem = unreduced_problem(cell, arm, box)
    narrow = problem.narrowed(INSIDE)
    found = [_where_they_stand(narrow, parameters, seed)]
    own = staged(narrow, parameters, seed)
    if own is not None:
        found.append(on_task(narrow, own.seeds))
    paths = [path for seeds in found for path in _finished(cell, problem, seeds)]
    evaluated = parameters.seeds
    if sum(path.violation == 0.0 for path in paths) < ENOUGH and time.perf_counter() < deadline:
        followed = follow(cell, problem, seed, deadline)
        paths += followed[0]
        evaluated += followed[1]
    return VariedPaths(sorted(paths, key=lambda p: (p.violation > 0.0, p.violation, p.objective)), evaluated)


def on_task(problem: UnreducedProblem, seeds: Seeds) -> Seeds:
    """Seeds brought exactly onto the task where they stand, without what does not arrive."""
    soft = Iterations(4, 0.1, 1e3, base_moves=False)
    seeds = gauss_newton(problem, gauss_newton(problem, seeds, soft), replace(soft, pull=0.0))
    return seeds.take(np.flatnonzero(figures(problem, seeds).error < EXACT))


def follow(cell: Cell, problem: UnreducedProblem, seed: int, deadline: float) -> tuple[list[LayeredPath], int]:
    """Paths followed from random postures, and how many."""
    count = FOLLOWED if len(cell.task) < LONG_TASK else FOLLOWED_LONG
    region = np.stack([problem.base_lower, problem.base_upper], axis=1)
    region[:3] += problem.origin[:, None]
    if problem.arm.base.yaw_free:
        region[3] = problem.arm.base.bounds[3]
    return continue_paths(cell, problem.arm, region, seed, count, deadline), count


def _where_they_stand(problem: UnreducedProblem, parameters: UnreducedParameters, seed: int) -> Seeds:
    """Paths from the bases at which seeds first take the task's middle."""
    seeds, anchors = first_seeds(problem, parameters, seed)
    if not len(seeds):
        return seeds
    seeds, keys, poses = spread(problem, seeds, anchors, parameters, base_moves=False)
    seeds = seeds.take(np.flatnonzero(figures(keys, seeds).error < parameters.far))
    middle, middle_poses = middle_problem(problem, parameters)
    how = Iterations(parameters.final_iterations, parameters.final_pull, parameters.stiff, base_moves=False)
    seeds = Seeds(through(problem, poses, middle_poses, seeds.joints), seeds.bases)
    seeds = best_windings(middle, gauss_newton(middle, seeds, how))
    seeds = seeds.take(np.flatnonzero(figures(middle, seeds).error < parameters.unreached))
    if problem.arm.min_conditioning is not None and len(seeds):
        how = replace(how, count=CONDITIONED, conditioning=problem.arm.min_conditioning)
        seeds = gauss_newton(middle, seeds, how)
    every = np.arange(len(problem.positions))
    if len(middle_poses) < len(every):
        seeds = Seeds(through(problem, middle_poses, every, seeds.joints), seeds.bases)
    return on_task(problem, seeds)


def _finished(cell: Cell, problem: UnreducedProblem, seeds: Seeds) -> list[LayeredPath]:
    points = [problem.point(seeds.joints[:, :, k], base) for k, base in enumerate(seeds.bases)]
    return [finish_path(cell, problem.arm, p.position, p.yaw, p.joints.T.copy()) for p in points]
