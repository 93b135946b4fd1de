"""Global search of one arm on the reduced problem: many bases at once, then the best few improved together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.robot.posture import ALL_SIGNS, Signs
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.parameters.screening import SCREENING, ScreeningParameters
from duocell.optimizer.reduction.base_sample import BoxFrame
from duocell.optimizer.reduction.box import spread
from duocell.optimizer.reduction.reduced import (
    Paths,
    ReducedProblem,
    conditioning_shortfall,
    evaluate,
    evaluate_fully,
    evaluate_signed,
)
from duocell.optimizer.reduction.singular_minima import singular_minima

CHUNK = 1024
"""Positions evaluated at once, to bound memory."""


@dataclass(frozen=True, eq=False, slots=True)
class Candidate:
    """A base position with a posture, on the reduced problem.

    Attributes:
        position: (3,) m. signs: (3,) posture. objective: E. violation: m and rad added, 0 if usable.
    """

    position: Floats
    signs: Signs
    objective: float
    violation: float


def scored(problem: ReducedProblem, candidate: Candidate) -> float:
    """Objective of a candidate with its violation made dear."""
    return float(problem.score(np.asarray(candidate.objective), np.asarray(candidate.violation)))


def on_whole_task(problem: ReducedProblem, candidates: list[Candidate]) -> list[Candidate]:
    """Candidates as they are scored on a problem's own poses."""
    positions = np.array([c.position for c in candidates])
    paths = evaluate_fully(problem, positions, np.array([c.signs for c in candidates]))
    return [
        Candidate(c.position, c.signs, float(objective), float(violation))
        for c, objective, violation in zip(candidates, paths.objective[0], paths.violation[0], strict=True)
    ]


@dataclass(frozen=True, eq=False, slots=True)
class Screen:
    """What a round of screening found.

    Attributes:
        candidates: distinct, best first.
        singular_minima: best points about places where the cost may fall below all that is usable among the candidates.
        evaluated: base × posture pairs looked at.
        problem: the (possibly sampled) task they were scored on.
        frame: of the box that was searched. spacing: (3,) m, between neighbours of the first look.
        parameters: of the stage.
    """

    candidates: list[Candidate]
    singular_minima: list[Candidate]
    evaluated: int
    problem: ReducedProblem
    frame: BoxFrame
    spacing: Floats
    parameters: ScreeningParameters


def screen(
    problem: ReducedProblem, box: Floats, seed: int, round_: int = 0, parameters: ScreeningParameters = SCREENING
) -> Screen:
    """Search the box once.

    Args:
        problem: the arm and the task.
        box: (3, 2) m, as from `duocell.optimizer.reduction.box.search_box`.
        seed: of the point set.
        round_: 0 for the first look; later rounds look closer, at other points.
        parameters: of the stage.

    Returns:
        Candidates improved on the sampled task.
    """
    careful = problem.arm.min_conditioning is not None
    coarse = problem.sampled(parameters.careful_poses if careful else parameters.coarse_poses).stricter(10.0**round_)
    small = problem.sampled(parameters.sampled_poses).stricter(10.0**round_)
    count = parameters.points[int(np.sum(box[:, 1] > box[:, 0]))]
    if count > 1:
        count *= 4**round_ * (parameters.thinned if careful else 1)
    frame = BoxFrame.of(problem, box)
    points = frame.sample(count, seed + round_)
    spacing = spacing_of(box, len(points))
    net = _net(coarse, points, spacing, parameters)
    picked = improve(coarse, _pick(net, parameters), frame, spacing, parameters.first_steps, parameters.cloud)
    picked.sort(key=lambda c: scored(coarse, c))
    best = mixed(picked, 2 * parameters.last, parameters.of_a_posture) if careful else picked[: parameters.last]
    if len(small.positions) < len(problem.positions):
        best += _by_whole_task(problem, net, parameters)
    found = improve(small, best, frame, 0.5**parameters.first_steps * spacing, parameters.last_steps, parameters.cloud)
    if careful:
        strict, steps = small.stricter(parameters.stricter), parameters.first_steps + parameters.last_steps
        found += improve(strict, _of_every_posture(net), frame, spacing, steps, parameters.cloud)
    found.sort(key=lambda c: scored(small, c))
    evaluated = len(points) * int(np.sum(problem.postures))
    minima = _in_singular_minima(small, frame, spacing, found, parameters)
    return Screen(distinct(found, 0.05 * spacing), minima, evaluated, small, frame, spacing, parameters)


def _in_singular_minima(
    problem: ReducedProblem,
    frame: BoxFrame,
    spacing: Floats,
    found: list[Candidate],
    parameters: ScreeningParameters,
) -> list[Candidate]:
    """The best point about every place where the cost may fall below that of the usable candidates, in a singular
    minimum, which is something that joint availability alone has.
    """
    if not problem.objective.bounded:
        return []
    known = min((candidate.objective for candidate in found if candidate.violation == 0.0), default=np.inf)
    around, signs = singular_minima(problem, frame.box, spacing, known)
    if not len(around):
        return []
    paths = evaluate_signed(problem, around.reshape(-1, 3), np.repeat(signs, around.shape[1], axis=0))
    places = [
        Candidate(circle[0], (s[0], s[1], s[2]), np.inf, np.inf)
        for circle, s in zip(around, signs.tolist(), strict=True)
    ]
    best = sorted(_keep_best(problem, around, paths, places), key=lambda c: scored(problem, c))
    radius = np.where(frame.box[:, 1] > frame.box[:, 0], parameters.singular_radius, 0.0)
    return improve(problem, best[: parameters.singular_minima], frame, radius, parameters.last_steps, parameters.cloud)


def spacing_of(box: Floats, count: int) -> Floats:
    """(3,) m: distance between neighbours of ``count`` points spread over a box, alike in all directions.

    A side that is shorter than this distance is a spacing wide.
    """
    width: Floats = box[:, 1] - box[:, 0]
    spacing, longer = width.copy(), width > 0.0
    while np.any(longer):
        even = float(np.prod(width[longer]) / count) ** (1.0 / int(np.sum(longer)))
        if np.all(width[longer] >= even):
            spacing[longer] = even
            break
        longer &= width >= even
    return spacing


@dataclass(frozen=True, eq=False, slots=True)
class _Net:
    """Points (N, 3) with objective, violation and score (8, N) on a few poses; and what is near what.

    ``neighbours`` (P, 2) are pairs of points, ``spacing`` (3,) m is about the distance between them.
    """

    points: Floats
    objective: Floats
    violation: Floats
    score: Floats
    neighbours: Ints
    spacing: Floats

    def candidate(self, k: int, i: int) -> Candidate:
        """Point i in posture k."""
        return Candidate(self.points[i], ALL_SIGNS[k], float(self.objective[k, i]), float(self.violation[k, i]))


def _net(problem: ReducedProblem, points: Floats, spacing: Floats, parameters: ScreeningParameters) -> _Net:
    """All points in all postures."""
    parts: list[Paths] = []
    for at in range(0, len(points), CHUNK):
        check_stop()
        parts.append(evaluate(problem, points[at : at + CHUNK]))
    objective = np.concatenate([part.objective for part in parts], axis=1)
    violation = np.concatenate([part.violation for part in parts], axis=1)
    if problem.arm.min_conditioning is not None:
        _add_shortfall(problem, parts, objective, violation, parameters)
    score = problem.score(objective, violation)
    return _Net(points, objective, violation, score, _neighbours(points, parameters.neighbours * spacing), spacing)


def _pick(net: _Net, parameters: ScreeningParameters) -> list[Candidate]:
    """The valleys of every posture, and the best usable points."""
    picked = [
        (k, i) for k in range(len(net.score)) for i in _valleys(net.score[k], net.neighbours)[: parameters.valleys]
    ]
    values = np.where(net.violation > 0.0, np.inf, net.objective)
    _take(picked, values, net.points, net.neighbours, net.spacing, parameters.more_usable)
    return [net.candidate(k, i) for k, i in picked]


def _of_every_posture(net: _Net) -> list[Candidate]:
    """The best usable point of every posture, or else the one that violates least."""
    value = np.where(net.violation > 0.0, np.inf, net.objective)
    none = ~np.any(np.isfinite(value), axis=1)
    value[none] = net.violation[none]
    best = np.argmin(value, axis=1)
    return [net.candidate(k, int(i)) for k, i in enumerate(best) if np.isfinite(net.score[k, i])]


def mixed(candidates: list[Candidate], count: int, of_a_posture: int) -> list[Candidate]:
    """The first of some candidates, but no more of one posture than a number while there are others."""
    seen: dict[Signs, int] = {}
    first: list[Candidate] = []
    then: list[Candidate] = []
    for candidate in candidates:
        seen[candidate.signs] = seen.get(candidate.signs, 0) + 1
        (first if seen[candidate.signs] <= of_a_posture else then).append(candidate)
    return (first + then)[:count]


def _by_whole_task(problem: ReducedProblem, net: _Net, parameters: ScreeningParameters) -> list[Candidate]:
    """The best of the promising points on all poses: between those of a sample a path may wind otherwise."""
    order = np.argsort(net.score, axis=None, kind="stable")[: parameters.looked_at]
    order = order[np.isfinite(net.score.ravel()[order])]
    k, i = np.unravel_index(order, net.score.shape)
    candidates = [net.candidate(int(a), int(b)) for a, b in zip(k, i, strict=True)]
    whole = sorted(on_whole_task(problem, candidates), key=lambda c: scored(problem, c)) if candidates else []
    return distinct(whole, net.spacing)[: parameters.last_of_whole]


def _neighbours(points: Floats, apart: Floats) -> Ints:
    """(P, 2) pairs of points no more than (3,) m apart in all free coordinates, the smaller index first."""
    free = apart > 0.0
    if not np.any(free):
        return np.empty((0, 2), dtype=np.int64)
    pairs: Ints = KDTree(points[:, free] / apart[free]).query_pairs(1.0, np.inf, output_type="ndarray")
    return pairs


def _valleys(score: Floats, neighbours: Ints) -> list[int]:
    """The best points of one posture that no neighbour betters: one for each valley the spread can tell apart."""
    first, second = neighbours.T
    bettered = np.zeros(len(score), dtype=bool)
    bettered[np.where(score[first] > score[second], first, second)] = True
    bottoms = np.flatnonzero(np.isfinite(score) & ~bettered)
    return [int(i) for i in bottoms[np.argsort(score[bottoms], kind="stable")]]


def _take(
    picked: list[tuple[int, int]], values: Floats, points: Floats, neighbours: Ints, spacing: Floats, number: int
) -> None:
    """Add to ``picked`` the best (posture, point) of ``values`` (8, N), apart from those of its posture."""
    first, second = neighbours.T
    taken = np.zeros(values.shape, dtype=bool)
    for k, i in picked:
        taken[k, i] = True
    closed = taken.copy()
    for near, own in zip(closed, taken, strict=True):
        near[second[own[first]]] = True
        near[first[own[second]]] = True
    open_ = np.where(closed, np.inf, values)
    for _ in range(number):
        k, i = (int(index) for index in np.unravel_index(np.argmin(open_), open_.shape))
        if not np.isfinite(open_[k, i]):
            break
        picked.append((k, i))
        open_[k, _near(points, points[i], spacing)] = np.inf


def _add_shortfall(
    problem: ReducedProblem,
    parts: list[Paths],
    objective: Floats,
    violation: Floats,
    parameters: ScreeningParameters,
) -> None:
    """Add to ``violation`` (8, N) by how much the most promising paths violate the conditioning asked for."""
    score = problem.score(objective, violation)
    best = np.argsort(score, axis=None)[: parameters.conditioned]
    k, i = np.unravel_index(best[np.isfinite(score.ravel()[best])], score.shape)
    some = np.unique(np.linspace(0, len(problem.positions) - 1, parameters.conditioned_poses).round().astype(int))
    every = np.concatenate([part.joints[..., some] for part in parts], axis=2)
    joints = every[:, k, i]
    violation[k, i] += conditioning_shortfall(problem, joints)


def _near(points: Floats, point: Floats, spacing: Floats) -> Bools:
    """(N,) True for points within one spacing of ``point`` in every coordinate."""
    near: Bools = np.all(np.abs(points - point) <= spacing, axis=1)
    return near


def distinct(candidates: list[Candidate], spacing: Floats) -> list[Candidate]:
    """Candidates in order, without those within ``spacing`` of an earlier one of the same posture."""
    kept: list[Candidate] = []
    for candidate in candidates:
        same = [other.position for other in kept if other.signs == candidate.signs]
        if not same or not np.any(_near(np.array(same), candidate.position, spacing)):
            kept.append(candidate)
    return kept


def improve(
    problem: ReducedProblem,
    candidates: list[Candidate],
    frame: BoxFrame,
    radius: Floats,
    steps: int,
    cloud: int = SCREENING.cloud,
) -> list[Candidate]:
    """Improve all candidates together: ``cloud`` points are strewn around each, the best is kept, the cloud halves.

    No derivatives, so the edges of the allowed set do no harm; the local solver does the last digits.
    """
    if not candidates or not np.any(radius > 0.0):
        return candidates
    strewn = 2.0 * spread(np.array([[0.0, 1.0]] * 3), cloud, 7) - 1.0
    strewn[0] = 0.0
    strewn = frame.turned(strewn)
    best = candidates
    for _ in range(steps):
        check_stop()
        centres = np.array([c.position for c in best])
        signs = np.repeat(np.array([c.signs for c in best], dtype=np.int64), cloud, axis=0)
        points = np.clip(centres[:, None, :] + strewn * radius, frame.box[:, 0], frame.box[:, 1])
        paths = evaluate_fully(problem, points.reshape(-1, 3), signs)
        best = _keep_best(problem, points, paths, best)
        radius = 0.5 * radius
    return best


def _keep_best(problem: ReducedProblem, points: Floats, paths: Paths, candidates: list[Candidate]) -> list[Candidate]:
    """Best point of each cloud (K, P, 3)."""
    shape = points.shape[:2]
    objective, violation = paths.objective[0].reshape(shape), paths.violation[0].reshape(shape)
    winner: Ints = np.argmin(problem.score(objective, violation), axis=1)
    rows = np.arange(len(points))
    chosen = points[rows, winner]
    return [
        Candidate(chosen[k], candidates[k].signs, float(objective[k, winner[k]]), float(violation[k, winner[k]]))
        for k in rows
    ]
