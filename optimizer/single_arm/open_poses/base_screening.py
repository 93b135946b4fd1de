"""Base positions worth a local solve, of an arm whose poses leave something open: looked at on samples of that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.sampling import even_points
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import TURN, Arm
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.base_sample import BoxFrame
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.reduction.screening import Candidate, distinct, mixed, scored, spacing_of
from duocell.optimizer.single_arm.open_poses.sampled_paths import SampledPaths, SampledTask, evaluate_sampled

COARSE_POSES, FINE_POSES = 5, 24
"""Poses that bases are looked at with at first, and that the best of them are improved with."""
POINTS = {0: 1, 1: 32, 2: 144, 3: 384}
"""Base positions of the first round by number of free coordinates; four times as many in each later one."""
LOOKED_AT, KEPT, OF_A_POSTURE, BEST = 256, 12, 3, 6
"""Places and postures among which neighbours are left out, those that are improved, those of one posture at most, and
those that are improved further."""
SAME, ABOUT = 0.02, 24
"""Share of a spacing within which two candidates are one, and points about an optimum that are looked at."""
CLOUD, FIRST_STEPS, LAST_STEPS = 8, 3, 3
"""Points about a candidate, and how often they are drawn together with few poses and with many."""


@dataclass(frozen=True, eq=False, slots=True)
class OpenScreen:
    """What a round found: candidates, best first, and how many bases and postures were looked at."""

    candidates: list[Candidate]
    evaluated: int
    spacing: Floats


def screen_open(cell: Cell, arm: Arm, problem: ReducedProblem, box: Floats, seed: int, round_: int) -> OpenScreen:
    """Search the box (3, 2) m once; later rounds look closer, at other points."""
    frame, count = BoxFrame.of(problem, box), POINTS[int(np.sum(box[:, 1] > box[:, 0]))]
    points = frame.sample(count * 4**round_ if count > 1 else 1, seed + round_)
    spacing = spacing_of(box, len(points))
    coarse = SampledTask.of(cell, arm, problem, spread_poses(cell, COARSE_POSES), coarse=True)
    fine = SampledTask.of(cell, arm, problem, spread_poses(cell, FINE_POSES), coarse=False)
    candidates = _best(coarse.problem, points, evaluate_sampled(coarse, points))
    picked = mixed(distinct(candidates, spacing), KEPT, OF_A_POSTURE)
    picked = _improved(coarse, picked, frame, spacing, FIRST_STEPS)
    picked = distinct(sorted(picked, key=lambda c: scored(coarse.problem, c)), 0.1 * spacing)[:BEST]
    found = _improved(fine, picked, frame, 0.5**FIRST_STEPS * spacing, LAST_STEPS)
    found = distinct(sorted(found, key=lambda c: scored(fine.problem, c)), SAME * spacing)
    return OpenScreen(found, len(points) * int(np.sum(problem.postures)), spacing)


def spread_poses(cell: Cell, count: int) -> Ints:
    """About ``count`` poses of the task, ascending: first and last of every segment, and some between."""
    m = len(cell.task)
    if m <= count:
        return np.arange(m)
    rows = [np.linspace(s.start, s.stop - 1, max(2, round(count * (s.stop - s.start) / m))) for s in cell.task.segments]
    return np.unique(np.concatenate(rows).round().astype(np.int64))


def start_of(cell: Cell, arm: Arm, task: SampledTask, candidate: Candidate) -> ArmSolution:
    """The sampled path of a candidate as a start of a local solve; ``task`` has all poses."""
    found = evaluate_sampled(task, candidate.position[None], np.array([candidate.signs]))
    return _point(cell, arm, task, candidate, found)


def best_start_about(
    cell: Cell, arm: Arm, task: SampledTask, known: ArmSolution, box: Floats, radius: Floats
) -> tuple[float, ArmSolution]:
    """Score and start of the best sampled path from where a solution stands, in any posture, or about it in its own.

    Args:
        cell: the cell. arm: the arm. task: all poses. known: the solution.
        box: (3, 2) m, bases that are allowed. radius: (3,) m, how far about it.
    """
    if known.signs is None:
        raise AssertionError("an arm with a reduced problem has a posture")
    problem, place = task.problem, known.position
    cloud = place + (2.0 * even_points(3, ABOUT, 11) - 1.0) * radius
    around = np.clip(cloud, box[:, 0], box[:, 1])
    here = evaluate_sampled(task, place[None])
    there = evaluate_sampled(task, around, np.tile(known.signs, (ABOUT, 1)))
    scores = np.concatenate(
        [
            problem.score(here.paths.objective, here.paths.violation)[:, 0],
            problem.score(there.paths.objective, there.paths.violation)[0],
        ]
    )
    k = int(np.argmin(scores))
    postures = len(ALL_SIGNS)
    signs, position = (ALL_SIGNS[k], place) if k < postures else (known.signs, around[k - postures])
    return float(scores[k]), start_of(cell, arm, task, Candidate(position, signs, float(scores[k]), 0.0))


def _point(cell: Cell, arm: Arm, task: SampledTask, candidate: Candidate, found: SampledPaths) -> ArmSolution:
    """The path of the only base and posture."""
    chosen = found.chosen[0, 0]
    values = task.samples.values[np.arange(len(chosen)), chosen].copy()
    freedom = cell.freedom(arm)
    for i in np.flatnonzero(np.any(np.isinf(freedom.upper), axis=0)):
        for segment in cell.task.segments:
            values[segment, i] = np.unwrap(values[segment, i], period=TURN)
    values = np.clip(values, freedom.lower, freedom.upper)
    paths = found.paths
    return ArmSolution(candidate.position, float(paths.yaw[0, 0]), paths.joints[:, 0, 0].T, candidate.signs, values)


def _best(problem: ReducedProblem, points: Floats, found: SampledPaths) -> list[Candidate]:
    """The best places and postures, best first."""
    score = problem.score(found.paths.objective, found.paths.violation)
    order = np.argsort(score, axis=None, kind="stable")[:LOOKED_AT]
    k, i = np.unravel_index(order[np.isfinite(score.ravel()[order])], score.shape)
    objective, violation = found.paths.objective[k, i], found.paths.violation[k, i]
    return [
        Candidate(points[place], ALL_SIGNS[posture], float(value), float(broken))
        for posture, place, value, broken in zip(k, i, objective, violation, strict=True)
    ]


def _improved(
    task: SampledTask, candidates: list[Candidate], frame: BoxFrame, radius: Floats, steps: int
) -> list[Candidate]:
    """Candidates at the best of points strewn about them, in clouds that shrink by half; scored on the task's poses."""
    if not candidates:
        return []
    free: Bools = radius > 0.0
    cloud = np.zeros((CLOUD if np.any(free) else 1, 3))
    cloud[1:] = 2.0 * even_points(3, CLOUD, 7)[1 : len(cloud)] - 1.0
    best = candidates
    for _ in range(steps if np.any(free) else 1):
        check_stop()
        centres, signs = np.array([c.position for c in best]), np.array([c.signs for c in best], dtype=np.int64)
        points = np.clip(centres[:, None] + cloud * radius, frame.box[:, 0], frame.box[:, 1])
        found = evaluate_sampled(task, points.reshape(-1, 3), np.repeat(signs, len(cloud), axis=0))
        objective = found.paths.objective[0].reshape(points.shape[:2])
        violation = found.paths.violation[0].reshape(points.shape[:2])
        winner = np.argmin(task.problem.score(objective, violation), axis=1)
        best = [
            Candidate(points[k, w], best[k].signs, float(objective[k, w]), float(violation[k, w]))
            for k, w in enumerate(winner)
        ]
        radius = 0.5 * radius
    return best
