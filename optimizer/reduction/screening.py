"""Global search of one arm on the reduced problem: many bases at once, then the best few improved together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.robot.posture import ALL_SIGNS, Signs
from duocell.optimizer.monitoring.watch import check_stop
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

COARSE_POSES, CAREFUL_POSES = 5, 12
"""Poses that the points of the spread are looked at with; more where a conditioning is asked for."""
SAMPLED_POSES = 32
"""Poses of a long task that the best of them are improved with; what comes out is checked on all."""
POINTS = {0: 1, 1: 64, 2: 512, 3: 1536}
"""Base positions of the first round by number of free coordinates; each has eight postures."""
ROUNDS = 4
"""A later round has four times the points of the one before, and is run only while nothing usable was found."""
VALLEYS, NEIGHBOURS = 8, 1.1
"""Valleys followed per posture; spacings within which points are neighbours."""
MORE_USABLE = 3
"""Usable candidates improved beside the valleys, which may lie outside the limits."""
CLOUD = 10
"""Points strewn around each of them; the cloud shrinks to half in each step."""
FIRST_STEPS, LAST_STEPS, LAST = 1, 4, 10
"""Steps with all candidates, and further ones with the best of them."""
OF_A_POSTURE = 6
"""Of these no more are of one posture while there are others."""
LOOKED_AT, LAST_OF_WHOLE = 128, 6
"""Points of the spread that are looked at on the whole of a long task, and how many of them are improved too."""
SINGULAR_MINIMA, SINGULAR_RADIUS = 3, 2e-3
"""Singular minima of the cost to be looked into, and how far from their bottoms (m)."""
CHUNK = 1024
"""Positions evaluated at once, to bound memory."""
THINNED = 2
"""Times as many points where a conditioning is asked for: it thins the usable set out."""
STRICTER = 100.0
"""How much dearer violations are where the best usable point of a posture is improved all the same: what a conditioning
rules out may cost half as much, and draws everything else away."""
CONDITIONED, CONDITIONED_POSES = 8192, 5
"""Paths of a round whose conditioning is looked at, and at how many of their poses: singular values are dear."""


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
    """

    candidates: list[Candidate]
    singular_minima: list[Candidate]
    evaluated: int
    problem: ReducedProblem
    frame: BoxFrame
    spacing: Floats


def screen(problem: ReducedProblem, box: Floats, seed: int, round_: int = 0) -> Screen:
    """Search the box once.

    Args:
        problem: the arm and the task.
        box: (3, 2) m, as from `duocell.optimizer.reduction.box.search_box`.
        seed: of the point set.
        round_: 0 for the first look; later rounds look closer, at other points.

    Returns:
        Candidates improved on the sampled task.
    """
    careful = problem.arm.min_conditioning is not None
    coarse = problem.sampled(CAREFUL_POSES if careful else COARSE_POSES).stricter(10.0**round_)
    small = problem.sampled(SAMPLED_POSES).stricter(10.0**round_)
    count = POINTS[int(np.sum(box[:, 1] > box[:, 0]))]
    if count > 1:
        count *= 4**round_ * (THINNED if careful else 1)
    frame = BoxFrame.of(problem, box)
    points = frame.sample(count, seed + round_)
    spacing = _spacing(box, len(points))
    net = _net(coarse, points, spacing)
    picked = improve(coarse, _pick(coarse, net), frame, spacing, FIRST_STEPS)
    picked.sort(key=lambda c: scored(coarse, c))
    best = mixed(picked, 2 * LAST, OF_A_POSTURE) if careful else picked[:LAST]
    if len(small.positions) < len(problem.positions):
        best += _by_whole_task(problem, net)
    found = improve(small, best, frame, 0.5**FIRST_STEPS * spacing, LAST_STEPS)
    if careful:
        found += improve(small.stricter(STRICTER), _of_every_posture(net), frame, spacing, FIRST_STEPS + LAST_STEPS)
    found.sort(key=lambda c: scored(small, c))
    evaluated = len(points) * int(np.sum(problem.postures))
    return Screen(
        distinct(found, 0.05 * spacing), _in_notches(small, frame, spacing, found), evaluated, small, frame, spacing
    )


def _in_notches(problem: ReducedProblem, frame: BoxFrame, spacing: Floats, found: list[Candidate]) -> list[Candidate]:
    """The best point about every place where the cost may fall below that of the usable candidates, in a singular
    minimum.
    """
    known = min((candidate.objective for candidate in found if candidate.violation == 0.0), default=np.inf)
    around, signs = singular_minima(problem, frame.box, spacing, known)
    if not len(around):
        return []
    paths = evaluate_signed(problem, around.reshape(-1, 3), np.repeat(signs, around.shape[1], axis=0))
    places = [
        Candidate(circle[0], (s[0], s[1], s[2]), np.inf, np.inf)
        for circle, s in zip(around, signs.tolist(), strict=True)
    ]
    best = sorted(_keep_best(problem, around, paths, places), key=lambda c: scored(problem, c))[:SINGULAR_MINIMA]
    free = frame.box[:, 1] > frame.box[:, 0]
    return improve(problem, best, frame, SINGULAR_RADIUS * free.astype(np.float64), LAST_STEPS)


def _spacing(box: Floats, count: int) -> Floats:
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


def _net(problem: ReducedProblem, points: Floats, spacing: Floats) -> _Net:
    """All points in all postures."""
    parts: list[Paths] = []
    for at in range(0, len(points), CHUNK):
        check_stop()
        parts.append(evaluate(problem, points[at : at + CHUNK]))
    objective = np.concatenate([part.objective for part in parts], axis=1)
    violation = np.concatenate([part.violation for part in parts], axis=1)
    if problem.arm.min_conditioning is not None:
        _add_shortfall(problem, parts, objective, violation)
    score = problem.score(objective, violation)
    return _Net(points, objective, violation, score, _neighbours(points, spacing), spacing)


def _pick(problem: ReducedProblem, net: _Net) -> list[Candidate]:
    """The valleys of every posture, and the best usable points."""
    picked = [(k, i) for k in range(len(net.score)) for i in _valleys(net.score[k], net.neighbours)]
    values = np.where(net.violation > 0.0, np.inf, net.objective)
    _take(picked, values, net.points, net.neighbours, net.spacing, MORE_USABLE)
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


def _by_whole_task(problem: ReducedProblem, net: _Net) -> list[Candidate]:
    """The best of the promising points on all poses: between those of a sample a path may wind otherwise."""
    order = np.argsort(net.score, axis=None, kind="stable")[:LOOKED_AT]
    order = order[np.isfinite(net.score.ravel()[order])]
    k, i = np.unravel_index(order, net.score.shape)
    candidates = [net.candidate(int(a), int(b)) for a, b in zip(k, i, strict=True)]
    whole = sorted(on_whole_task(problem, candidates), key=lambda c: scored(problem, c)) if candidates else []
    return distinct(whole, net.spacing)[:LAST_OF_WHOLE]


def _neighbours(points: Floats, spacing: Floats) -> Ints:
    """(P, 2) pairs of points that are neighbours in all free coordinates, the smaller index first."""
    free = spacing > 0.0
    if not np.any(free):
        return np.empty((0, 2), dtype=np.int64)
    pairs: Ints = KDTree(points[:, free] / (NEIGHBOURS * spacing[free])).query_pairs(1.0, np.inf, output_type="ndarray")
    return pairs


def _valleys(score: Floats, neighbours: Ints) -> list[int]:
    """The best points of one posture that no neighbour betters: one for each valley the spread can tell apart."""
    first, second = neighbours.T
    bettered = np.zeros(len(score), dtype=bool)
    bettered[np.where(score[first] > score[second], first, second)] = True
    bottoms = np.flatnonzero(np.isfinite(score) & ~bettered)
    return [int(i) for i in bottoms[np.argsort(score[bottoms], kind="stable")][:VALLEYS]]


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


def _add_shortfall(problem: ReducedProblem, parts: list[Paths], objective: Floats, violation: Floats) -> None:
    """Add to ``violation`` (8, N) by how much the most promising paths violate the conditioning asked for."""
    score = problem.score(objective, violation)
    best = np.argsort(score, axis=None)[:CONDITIONED]
    k, i = np.unravel_index(best[np.isfinite(score.ravel()[best])], score.shape)
    some = np.unique(np.linspace(0, len(problem.positions) - 1, CONDITIONED_POSES).round().astype(int))
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
    problem: ReducedProblem, candidates: list[Candidate], frame: BoxFrame, radius: Floats, steps: int
) -> list[Candidate]:
    """Improve all candidates together: points are strewn around each, the best is kept, the cloud shrinks by half.

    No derivatives, so the edges of the allowed set do no harm; the local solver does the last digits.
    """
    if not candidates or not np.any(radius > 0.0):
        return candidates
    cloud = 2.0 * spread(np.array([[0.0, 1.0]] * 3), CLOUD, 7) - 1.0
    cloud[0] = 0.0
    cloud = frame.turned(cloud)
    best = candidates
    for _ in range(steps):
        check_stop()
        centres = np.array([c.position for c in best])
        signs = np.repeat(np.array([c.signs for c in best], dtype=np.int64), CLOUD, axis=0)
        points = np.clip(centres[:, None, :] + cloud * radius, frame.box[:, 0], frame.box[:, 1])
        paths = evaluate_fully(problem, points.reshape(-1, 3), signs)
        best = _keep_best(problem, points, paths, best)
        radius = 0.5 * radius
    return best


def _keep_best(problem: ReducedProblem, points: Floats, paths: Paths, candidates: list[Candidate]) -> list[Candidate]:
    """Best point of each cloud (K, CLOUD, 3)."""
    shape = points.shape[:2]
    objective, violation = paths.objective[0].reshape(shape), paths.violation[0].reshape(shape)
    winner: Ints = np.argmin(problem.score(objective, violation), axis=1)
    rows = np.arange(len(points))
    chosen = points[rows, winner]
    return [
        Candidate(chosen[k], candidates[k].signs, float(objective[k, winner[k]]), float(violation[k, winner[k]]))
        for k in rows
    ]
