"""Candidates of one arm: bases and paths that suit the arm's own task, the obstacles and the floor, best first."""

from __future__ import annotations

import time
from bisect import insort
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import ALL_SIGNS, Signs
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.refinement import REFINEMENT, RefinementParameters
from duocell.optimizer.reduction.box import search_box, spread
from duocell.optimizer.reduction.reduced import ReducedProblem, conditioning_shortfall, evaluate
from duocell.optimizer.single_arm.redundant.varied_paths import varied_paths
from duocell.optimizer.sqp.refine import penalty_of
from duocell.optimizer.verification.scene import Scene, alone_scene, own_violations, world_yaw
from duocell.optimizer.verification.verify import check

POINTS = {0: 1, 1: 100, 2: 1600, 3: 4000}
"""Base positions of the first round by number of free coordinates; each has eight postures."""
CHUNK = 256
LOOKED_AT = 400
"""Of the usable ones, the best this many are looked at with their surroundings."""
BATCH = 40
"""Of these at once."""
KEPT, WIDER = 100, 3
"""Members of a pool; so many times as many where couplings tie the bases."""
FRONT = 30
"""The best ones are looked at however near to each other they stand; the others make room for different places:"""
APART, MOST_BESIDE = 0.1, 4
"""m; no member of the same posture stands this near to a clean one, nor to so many that are not."""
REPAIRABLE = 0.15
"""m or rad; what violates more than this is not kept."""


@dataclass(frozen=True, eq=False, slots=True)
class Member:
    """One candidate.

    Attributes:
        point: base and path, inside the arm's limits. objective: E.
        violation: largest shortfall of floor, obstacles, own part and self [m], <= 0 if there is none.
    """

    point: ArmSolution
    objective: float
    violation: float

    def score(self, penalty: float) -> float:
        """E with the shortfall made dear."""
        return self.objective + penalty * max(self.violation, 0.0)


@dataclass(frozen=True, eq=False, slots=True)
class Pool:
    """Candidates of one arm.

    Attributes:
        members: best first. usable: many more of its paths, best first, whatever stands around them.
        evaluated: bases and postures looked at.
    """

    members: list[Member]
    usable: list[Member]
    evaluated: int

    def representatives(self, count: int) -> list[Member]:
        """The best usable paths of every posture, ``count`` of each."""
        taken: dict[Signs | None, int] = {}
        kept = []
        for member in self.usable:
            taken[member.point.signs] = taken.get(member.point.signs, 0) + 1
            if taken[member.point.signs] <= count:
                kept.append(member)
        return kept


def pool_of(
    scene: Scene,
    index: int,
    problem: ReducedProblem | None,
    round_: int,
    seed: int,
    deadline: float,
    refinement: RefinementParameters = REFINEMENT,
) -> Pool:
    """Candidates of one arm.

    Args:
        scene: the cell. index: of the arm. problem: its reduced problem, or None.
        round_: 0 for the first look; every later one looks at four times as many bases, and keeps twice as many.
        seed: of the point set. deadline: `time.perf_counter` value, soft. refinement: of what comes after.
    """
    arm = scene.cell.arms[index]
    alone = alone_scene(scene.cell, arm)
    penalty = penalty_of(scene.cell, refinement)
    if problem is not None:
        found, evaluated = _reduced_points(scene.cell, arm, problem, round_, seed)
    else:
        found, evaluated = _general_points(scene.cell, arm, seed + round_, deadline)
    wide = WIDER if scene.cell.couplings else 1  # ties leave few members where they are
    most, count = wide * KEPT * 2**round_, wide * LOOKED_AT * 2**round_
    select = _MemberSelection(alone, most, count, APART / wide**0.5, penalty, deadline)
    rest = found[count:]
    members = select(found) or select(rest[:: max(1, len(rest) // count)])  # the best may all stand in something
    members.sort(key=lambda member: member.score(penalty))
    return Pool(members[:most], [Member(point, objective, 0.0) for objective, point in found], evaluated)


@dataclass(frozen=True, eq=False, slots=True)
class _MemberSelection:
    """Chooses candidates by what they are like among their surroundings.

    Attributes:
        alone: the arm. most: members wanted. count: candidates looked at. apart: m, see `APART`.
        penalty: of a metre. deadline: `time.perf_counter` value, soft.
    """

    alone: Scene
    most: int
    count: int
    apart: float
    penalty: float
    deadline: float

    def __call__(self, found: Sequence[tuple[float, ArmSolution]]) -> list[Member]:
        """Those that can be repaired, of candidates in the order of their objective."""
        kept, looked = _SpreadMembers(self.apart), 0
        scores: list[float] = []
        rest = iter(found)
        while looked < self.count and time.perf_counter() < self.deadline:
            check_stop()
            room = (entry for entry in rest if len(kept.members) < FRONT or kept.admits(entry[1]))
            batch = list(islice(room, BATCH))
            if not batch or (len(scores) >= self.most and scores[self.most - 1] <= batch[0][0]):
                break  # the rest cannot score better
            looked += len(batch)
            violations = own_violations(self.alone, [point for _, point in batch])
            for (objective, point), violation in zip(batch, violations, strict=True):
                if violation <= REPAIRABLE:
                    kept.add(Member(point, objective, violation))
                    insort(scores, kept.members[-1].score(self.penalty))
        return kept.members


class _SpreadMembers:
    """Members so far, and whether there is room beside them."""

    def __init__(self, apart: float) -> None:
        self._apart = apart
        self.members: list[Member] = []
        self._places: dict[Signs | None, list[tuple[list[float], bool]]] = {}

    def add(self, member: Member) -> None:
        """Take one in."""
        self.members.append(member)
        place = member.point.position.tolist()
        self._places.setdefault(member.point.signs, []).append((place, member.violation <= 0.0))

    def admits(self, point: ArmSolution) -> bool:
        """False beside a clean member of the same posture, or beside too many others."""
        here = point.position.tolist()
        beside = [clean for place, clean in self._places.get(point.signs, ()) if self._near(place, here)]
        return not any(beside) and len(beside) < MOST_BESIDE

    def _near(self, place: list[float], other: list[float]) -> bool:
        (x, y, z), (u, v, w), apart = place, other, self._apart
        return abs(x - u) < apart and abs(y - v) < apart and abs(z - w) < apart


def _reduced_points(
    cell: Cell, arm: Arm, problem: ReducedProblem, round_: int, seed: int
) -> tuple[list[tuple[float, ArmSolution]], int]:
    """Usable paths from an even spread of bases, by objective."""
    box = search_box(cell, arm)
    count = POINTS[int(np.sum(box[:, 1] > box[:, 0]))]
    positions = spread(box, count * 4**round_ if count > 1 else 1, seed + 17 * round_)
    found: list[tuple[float, ArmSolution]] = []
    for at in range(0, len(positions), CHUNK):
        some = positions[at : at + CHUNK]
        paths = evaluate(problem, some)
        for k, i in _on_floor(cell, arm, some, paths.yaw, np.argwhere(paths.violation == 0.0)):
            check_stop()
            joints = paths.joints[:, k, i]
            if arm.min_conditioning is None or conditioning_shortfall(problem, joints[:, None, :])[0] <= 0.0:
                point = ArmSolution(some[i], float(paths.yaw[k, i]), joints.T, ALL_SIGNS[k])
                found.append((float(paths.objective[k, i]), point))
    found.sort(key=lambda entry: entry[0])
    return found, len(positions) * int(np.sum(problem.postures))


def _on_floor(cell: Cell, arm: Arm, positions: Floats, yaws: Floats, usable: Ints) -> Ints:
    """Those of the pairs (u, 2) of a posture and a position (N, 3) whose base stands on the floor or nearly so."""
    floor = cell.surroundings.floor
    if floor is None or not len(usable):
        return usable
    footprint = cell.surroundings.footprint(arm.name)
    turned = world_yaw(arm, yaws[usable[:, 0], usable[:, 1]])
    return usable[floor.signed_distance(positions[usable[:, 1], :2], footprint, turned) >= -REPAIRABLE]


def _general_points(cell: Cell, arm: Arm, seed: int, deadline: float) -> tuple[list[tuple[float, ArmSolution]], int]:
    """Usable paths of an arm without a reduced problem, by objective."""
    found = varied_paths(cell, arm, search_box(cell, arm), seed, deadline)
    points = [
        (path.objective, ArmSolution(path.position, path.yaw, path.joints, path.signs))
        for path in found.paths
        if path.violation == 0.0 and len(path.joints)
    ]
    return [(value, point) for value, point in points if check(cell, arm, point).usable], found.evaluated


def with_optimum(pool: Pool, alone: Scene, optimum: ArmSolution, objective: float) -> Pool:
    """The pool with the uncoupled optimum in front."""
    return replace(pool, members=[Member(optimum, objective, own_violations(alone, [optimum])[0]), *pool.members])
