"""From many seeds to a few candidates: one pose, key poses, some poses, all poses, and fewer seeds at every step.

What is near a better seed is left out before every cut: more seeds are no cure for a ranking that keeps copies of one
basin. What a seed breaks of limits and steps is charged softly, for IPOPT repairs a little of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.optimizer.parameters.unreduced import UnreducedParameters
from duocell.optimizer.single_arm.redundant.draws import draw_seeds, drawn_postures, fit_to_bases
from duocell.optimizer.single_arm.redundant.gauss_newton import Iterations, gauss_newton
from duocell.optimizer.single_arm.redundant.key_poses import key_poses, partly_moved, reduced_to, shares
from duocell.optimizer.single_arm.redundant.ranking import Figures, best_windings, distinct, figures
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem

STEP_SLACK = 3.0
"""Times the allowed step that key poses may be apart: there are poses between them."""
JOB_DRAWS, JOB_TRIES = 1024, 3
"""Postures drawn for each further segment of a task sequence, and how many of them each seed tries there."""
JOB_ITERATIONS = 8
MOVED, MOVED_ERROR = 1e-3, 1e-4
"""Relative change of the cost in one more iteration, and error [m or rad], of a seed that still moves."""


@dataclass(frozen=True, eq=False, slots=True)
class Staged:
    """What the stages leave.

    Attributes:
        problem: whole. seeds: candidates on all poses, best first. figures: theirs.
        middle: the problem with the poses of the middle stages. pool: everything that got there.
        middle_poses: indices of these poses.
    """

    problem: UnreducedProblem
    seeds: Seeds
    figures: Figures
    middle: UnreducedProblem
    pool: Seeds
    middle_poses: Ints


def first_seeds(problem: UnreducedProblem, parameters: UnreducedParameters, seed: int) -> tuple[Seeds, Ints]:
    """Seeds (n, segments, K) that take the anchor pose of every segment, and the indices of these poses."""
    anchors = key_poses(problem, 1)
    lead = int(np.argmax([np.sum(problem.weights[segment]) for segment in problem.segments]))
    anchor = int(anchors[lead])
    q, bases = draw_seeds(problem, anchor, parameters.seeds, parameters.seeds * parameters.drawn, seed)
    one = problem.only(np.array([anchor]), np.ones(1))
    how = Iterations(parameters.reach_iterations, parameters.reach_pull, parameters.soft)
    seeds = gauss_newton(one, Seeds(q[:, None, :], bases), how)
    seeds = seeds.take(np.flatnonzero(figures(one, seeds).error < parameters.unreached))
    if len(anchors) == 1 or not len(seeds):
        return seeds, anchors
    parts = [
        seeds.joints[:, 0] if pose == anchor else _joined(problem, int(pose), seeds, parameters, seed)
        for pose in anchors
    ]
    return Seeds(np.stack(parts, axis=1), seeds.bases), anchors


def _joined(problem: UnreducedProblem, pose: int, seeds: Seeds, parameters: UnreducedParameters, seed: int) -> Floats:
    """(n, K) the cheapest posture found for another pose from the base of every seed."""
    one = problem.only(np.array([pose]), np.ones(1))
    draws = drawn_postures(problem, JOB_DRAWS, seed)
    tries = min(JOB_TRIES, draws.shape[1])
    others = fit_to_bases(problem, pose, seeds.bases, draws, tries)  # (n, tries, K)
    starts = np.concatenate([seeds.joints[:, :1], others], axis=1)
    n, each, count = starts.shape
    many = Seeds(starts.reshape(n, 1, each * count), np.tile(seeds.bases, (each, 1)))
    how = Iterations(JOB_ITERATIONS, parameters.spread_pull, parameters.soft, base_moves=False, apart=True)
    many = best_windings(one, gauss_newton(one, many, how))
    score = figures(one, many).score(np.inf, parameters).reshape(each, count)
    best = np.argmin(score, axis=0)
    chosen: Floats = many.joints.reshape(n, each, count)[:, best, np.arange(count)]
    return chosen


def spread(
    problem: UnreducedProblem, seeds: Seeds, anchors: Ints, parameters: UnreducedParameters, base_moves: bool = True
) -> tuple[Seeds, UnreducedProblem, Ints]:
    """Seeds from the anchor poses to the key poses; the key problem and its poses."""
    segments = len(problem.starts)
    poses = key_poses(problem, max(2, parameters.key_poses if segments <= 2 else parameters.key_poses // 2 + 1))
    keys, start = reduced_to(problem, poses), problem.only(anchors, np.ones(len(anchors)))
    own = np.searchsorted(problem.starts, poses, side="right") - 1
    seeds = Seeds(seeds.joints[:, own], seeds.bases)
    for part in parameters.spread_parts:
        how = Iterations(parameters.spread_iterations, parameters.spread_pull, parameters.soft, base_moves)
        seeds = gauss_newton(partly_moved(start, keys, part), seeds, how)
    how = Iterations(parameters.key_iterations, parameters.key_pull, parameters.soft, base_moves)
    return best_windings(keys, gauss_newton(keys, seeds, how)), keys, poses


def staged(problem: UnreducedProblem, parameters: UnreducedParameters, seed: int) -> Staged | None:
    """Candidates of one arm, or None where no seed gets to the key poses."""
    seeds, anchors = first_seeds(problem, parameters, seed)
    if not len(seeds):
        return None
    seeds, keys, poses = spread(problem, seeds, anchors, parameters)
    found = figures(keys, seeds)
    order = np.argsort(found.score(STEP_SLACK * problem.max_step, parameters), kind="stable")
    order = order[found.error[order] < parameters.far]
    seeds = seeds.take(
        distinct(problem, seeds, order, parameters.spread_kept, parameters.same_joints, parameters.same_base)
    )
    if not len(seeds):
        return None
    middle, middle_poses = middle_problem(problem, parameters)
    seeds = Seeds(through(problem, poses, middle_poses, seeds.joints), seeds.bases)
    arrive = Iterations(parameters.arrive_iterations, parameters.spread_pull, parameters.soft, base_moves=False)
    how = Iterations(parameters.middle_iterations, parameters.middle_pull, parameters.soft, steps=True)
    seeds = best_windings(middle, gauss_newton(middle, gauss_newton(middle, seeds, arrive), how))
    pool = seeds.take(np.argsort(figures(middle, seeds).score(middle.max_step, parameters), kind="stable"))
    every = np.arange(len(pool))
    kept = distinct(middle, pool, every, parameters.middle_kept, parameters.same_joints, parameters.same_base)
    seeds = settled(middle, pool.take(kept), parameters)
    seeds = carried(problem, seeds, middle_poses, parameters)
    seeds, found = ranked(problem, well_conditioned(problem, seeds, parameters), parameters)
    return Staged(problem, seeds, found, middle, pool, middle_poses)


def middle_problem(problem: UnreducedProblem, parameters: UnreducedParameters) -> tuple[UnreducedProblem, Ints]:
    """The problem with so many poses that the middle stages stay cheap, and which they are."""
    if len(problem.positions) <= parameters.middle_poses:
        every = np.arange(len(problem.positions))
        return problem, every
    poses = key_poses(problem, max(parameters.middle_poses // len(problem.starts), 3))
    return replace(reduced_to(problem, poses), max_step=np.pi), poses


def through(problem: UnreducedProblem, known: Ints, wanted: Ints, joints: Floats) -> Floats:
    """Joints (n, k, K) of known poses carried over to others (n, l, K)."""
    matrix = shares(problem, known)[wanted]
    carried_over: Floats = np.einsum("jl,ilk->ijk", matrix, joints)
    return carried_over


def settled(problem: UnreducedProblem, seeds: Seeds, parameters: UnreducedParameters) -> Seeds:
    """Seeds near their optima: those that still move and are not hopeless get more iterations than the others."""
    how = Iterations(parameters.final_iterations, parameters.final_pull, parameters.stiff, steps=True)
    seeds = best_windings(problem, gauss_newton(problem, seeds, how))
    before = figures(problem, seeds).cost
    one = Iterations(1, 0.7, parameters.stiff, steps=True, restraint=parameters.restraint)
    more = replace(one, count=parameters.more_iterations, pull=parameters.final_pull)
    for _ in range(2):
        seeds = gauss_newton(problem, seeds, one)
        found = figures(problem, seeds)
        good = found.cost[found.error < 1e-3]
        moving = (np.abs(found.cost - before) > MOVED * before) | (found.error > MOVED_ERROR)
        which = np.flatnonzero(moving & (found.cost < parameters.hopeless * np.min(good, initial=np.inf)))
        if len(which):
            moved = gauss_newton(problem, seeds.take(which), more)
            joints, bases = seeds.joints.copy(), seeds.bases.copy()
            joints[:, :, which], bases[which] = moved.joints, moved.bases
            seeds = Seeds(joints, bases)
        before = figures(problem, seeds).cost
    return seeds


def carried(problem: UnreducedProblem, seeds: Seeds, poses: Ints, parameters: UnreducedParameters) -> Seeds:
    """Seeds on the given poses carried over to all; of a long task the best ones only."""
    if len(poses) == len(problem.positions):
        return seeds
    every = np.arange(len(problem.positions))
    seeds = Seeds(through(problem, poses, every, seeds.joints), seeds.bases)
    on_poses = Iterations(2, parameters.middle_pull, parameters.soft, base_moves=False)
    seeds = gauss_newton(problem, seeds, on_poses)
    order = np.argsort(figures(problem, seeds).score(problem.max_step, parameters), kind="stable")
    kept = distinct(problem, seeds, order, parameters.whole_kept, parameters.near_joints, parameters.near_base)
    how = Iterations(parameters.middle_iterations, parameters.final_pull, parameters.stiff, steps=True)
    return best_windings(problem, gauss_newton(problem, seeds.take(kept), how))


def well_conditioned(problem: UnreducedProblem, seeds: Seeds, parameters: UnreducedParameters) -> Seeds:
    """Seeds, and beside those that violate the conditioning what becomes of them when self-motion is drawn to it."""
    wanted = problem.arm.min_conditioning or 0.0
    singular = np.flatnonzero(figures(problem, seeds, wanted).violation > 0.0)
    if not len(singular):
        return seeds
    how = Iterations(parameters.more_iterations, parameters.middle_pull, parameters.stiff, conditioning=wanted)
    return seeds.join(best_windings(problem, gauss_newton(problem, seeds.take(singular), how)))


def ranked(problem: UnreducedProblem, seeds: Seeds, parameters: UnreducedParameters) -> tuple[Seeds, Figures]:
    """Distinct seeds in the order in which they are worth a local solve, and their figures."""
    wanted = problem.arm.min_conditioning or 0.0
    found = figures(problem, seeds, wanted)
    score = found.score(problem.max_step, parameters)
    order = np.lexsort((score, ~likely(problem, found, parameters), found.violation > 0.0))
    order = order[found.error[order] < parameters.unreached]
    kept = distinct(problem, seeds, order, len(order), parameters.near_joints, parameters.near_base)
    return seeds.take(kept), found.take(kept)


def likely(problem: UnreducedProblem, found: Figures, parameters: UnreducedParameters) -> Bools:
    """(K,) False for what IPOPT will hardly repair."""
    steps = found.step <= parameters.repairable_step * problem.max_step
    fine: Bools = steps & (found.over <= parameters.repairable_over)
    return fine
