"""Candidates of one arm: bases and paths that suit the arm's own task, the obstacles and the floor, best first."""

from __future__ import annotations

import time
from bisect import insort
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from models.arm import Arm
from models.arrays import Bools, Floats
from models.cell import Cell
from models.posture import ALL_SIGNS
from optimizer.box import search_box, spread
from optimizer.coupled.refine import price_of
from optimizer.coupled.scene import Scene, world_yaw
from optimizer.general import screen_general
from optimizer.program import ArmPoint
from optimizer.reduced import ReducedProblem, conditioning_shortfall, evaluate
from optimizer.verify import check

POINTS = {0: 1, 1: 100, 2: 1600, 3: 4000}
"""Base positions of the first round by number of free coordinates; each has eight postures."""
CHUNK = 256
LOOKED_AT = 400
"""Of the usable ones, the best this many are looked at with their surroundings."""
BATCH = 40
"""Of these at once."""
KEPT = 80
"""Members of a pool."""
REPAIRABLE = 0.15
"""m or rad; what violates more than this is not kept."""


@dataclass(frozen=True, eq=False, slots=True)
class Member:
    """One candidate.

    Attributes:
        point: base and path, inside the arm's limits. objective: E.
        lack: largest shortfall of floor, obstacles, own part and self [m], <= 0 if there is none.
    """

    point: ArmPoint
    objective: float
    lack: float

    def score(self, price: float) -> float:
        """E with the shortfall made dear."""
        return self.objective + price * max(self.lack, 0.0)


@dataclass(frozen=True, eq=False, slots=True)
class Pool:
    """Candidates of one arm, best first, and how many bases and postures were looked at."""

    members: list[Member]
    evaluated: int


def pool_of(scene: Scene, index: int, problem: ReducedProblem | None, round_: int, seed: int, deadline: float) -> Pool:
    """Candidates of one arm.

    Args:
        scene: the cell. index: of the arm. problem: its reduced problem, or None.
        round_: 0 for the first look; every later one looks at four times as many bases, and keeps twice as many.
        seed: of the point set. deadline: `time.perf_counter` value, soft.
    """
    arm = scene.cell.arms[index]
    alone = alone_scene(scene.cell, arm)
    price = price_of(scene.cell)
    if problem is not None:
        found, evaluated = _reduced_points(scene.cell, arm, problem, round_, seed)
    else:
        found, evaluated = _general_points(scene.cell, arm, seed + round_, deadline)
    members: list[Member] = []
    most = KEPT * 2**round_
    scores: list[float] = []
    for at in range(0, len(found), BATCH):
        batch = found[at : at + BATCH]
        enough = len(scores) >= most and scores[most - 1] <= batch[0][0]  # the rest cannot score better
        if enough or at >= LOOKED_AT * 2**round_ or time.perf_counter() > deadline:
            break
        for (objective, point), lack in zip(batch, own_lacks(alone, [point for _, point in batch]), strict=True):
            if lack <= REPAIRABLE:
                members.append(Member(point, objective, lack))
                insort(scores, members[-1].score(price))
    members.sort(key=lambda member: member.score(price))
    return Pool(members[:most], evaluated)


def alone_scene(cell: Cell, arm: Arm) -> Scene:
    """The scene of one arm without the others and without couplings."""
    return Scene.of(replace(cell, arms=(arm,), couplings=()))


def own_lacks(alone: Scene, points: Sequence[ArmPoint]) -> list[float]:
    """Largest shortfall [m] of floor and distances at the poses of each point, as far as one arm alone is concerned."""
    contacts = alone.contact_lacks([[point] for point in points])
    return [max(alone.floor_lack([point]), float(lack)) for point, lack in zip(points, contacts, strict=True)]


def _reduced_points(
    cell: Cell, arm: Arm, problem: ReducedProblem, round_: int, seed: int
) -> tuple[list[tuple[float, ArmPoint]], int]:
    """Usable paths from an even spread of bases, by objective."""
    box = search_box(cell, arm)
    count = POINTS[int(np.sum(box[:, 1] > box[:, 0]))]
    positions = spread(box, count * 4**round_ if count > 1 else 1, seed + 17 * round_)
    found: list[tuple[float, ArmPoint]] = []
    for at in range(0, len(positions), CHUNK):
        some = positions[at : at + CHUNK]
        paths = evaluate(problem, some)
        usable = paths.violation == 0.0
        usable &= _on_floor(cell, arm, some, paths.yaw)
        for k, i in np.argwhere(usable):
            joints = paths.joints[:, k, i]
            if arm.min_conditioning is None or conditioning_shortfall(problem, joints[:, None, :])[0] <= 0.0:
                point = ArmPoint(some[i], float(paths.yaw[k, i]), joints.T, ALL_SIGNS[k])
                found.append((float(paths.objective[k, i]), point))
    found.sort(key=lambda entry: entry[0])
    return found, len(positions) * int(np.sum(problem.postures))


def _on_floor(cell: Cell, arm: Arm, positions: Floats, yaws: Floats) -> Bools:
    """(8, N) True where a base stands on the floor or nearly so."""
    floor = cell.surroundings.floor
    if floor is None:
        return np.ones(yaws.shape, dtype=np.bool_)
    places = np.tile(positions[:, :2], (len(yaws), 1))
    footprint = cell.surroundings.footprint(arm.name)
    free: Bools = floor.signed_distance(places, footprint, world_yaw(arm, yaws.ravel())) >= -REPAIRABLE
    return free.reshape(yaws.shape)


def _general_points(cell: Cell, arm: Arm, seed: int, deadline: float) -> tuple[list[tuple[float, ArmPoint]], int]:
    """Usable paths of an arm without a reduced problem, by objective."""
    screen = screen_general(cell, arm, search_box(cell, arm), seed, deadline)
    points = [
        (path.objective, ArmPoint(path.position, path.yaw, path.joints, path.signs))
        for path in screen.paths
        if path.violation == 0.0 and len(path.joints)
    ]
    return [(value, point) for value, point in points if check(cell, arm, point).usable], screen.evaluated


def with_optimum(pool: Pool, alone: Scene, optimum: ArmPoint, objective: float) -> Pool:
    """The pool with the uncoupled optimum in front."""
    return Pool([Member(optimum, objective, own_lacks(alone, [optimum])[0]), *pool.members], pool.evaluated)
