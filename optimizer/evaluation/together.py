"""Which paths of the arms go together: combinations in order of their cost, until one hits nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice, product

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.collision.collision import CollisionModel
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.clearance import PathClearance, check_clearance
from duocell.optimizer.evaluation.standing import Choice, Standing
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.scene import LIMITS, Scene

MOST, BATCH, WHOLE = 4096, 32, 16
"""Combinations considered; looked at together at the poses; and checked along the whole path."""


@dataclass(frozen=True, eq=False, slots=True)
class Together:
    """The arms of a layout on the paths that were chosen.

    Attributes:
        standing: one per arm.
        followed: the arms whose path was checked. path: that check; None where no clearance is asked for.
        settled: True if no other combination can be better than this one where this one is not clean.
    """

    standing: tuple[Standing, ...]
    followed: tuple[Arm, ...]
    path: PathClearance | None
    settled: bool


def together(cell: Cell, found: Sequence[Choice]) -> Together:
    """The cheapest combination of the arms' paths that hits nothing; the cheapest of all where there is none."""
    best = tuple(choice.best for choice in found)
    there = [one for one in best if one.there]
    followed = tuple(one.arm for one in there)
    settled = all(choice.complete for choice in found)
    if not cell.surroundings.clearances.any or not there:
        return Together(best, followed, None, settled)
    if len(there) < len(best):
        part = replace(cell, arms=followed, couplings=())
        model = CollisionModel(part.arms, cell.surroundings, cell.arms)
        return Together(best, followed, _whole(part, model, there), settled)
    scene = Scene.of(cell)
    path = _whole(cell, scene.model, best)
    if _passes(path) or any(one.reasons for one in best):
        return Together(best, followed, path, settled)
    others, all_seen = _combinations(found)
    checked = 0
    for first in range(0, len(others), BATCH):
        batch = others[first : first + BATCH]
        violations = scene.contact_violations([_points(one) for one in batch])
        for k in np.flatnonzero(violations <= LIMITS):
            if checked == WHOLE:
                return Together(best, followed, path, False)
            checked += 1
            whole = _whole(cell, scene.model, batch[k])
            if _passes(whole):
                return Together(batch[k], followed, whole, True)
    return Together(best, followed, path, settled and all_seen)


def _combinations(found: Sequence[Choice]) -> tuple[list[tuple[Standing, ...]], bool]:
    """All combinations but the cheapest, cheapest first; and whether these are all."""
    every = product(*(choice.standings for choice in found))
    listed = sorted(islice(every, MOST), key=lambda one: sum(standing.objective for standing in one))
    return listed[1:], next(every, None) is None


def _points(standing: Sequence[Standing]) -> list[ArmSolution]:
    return [one.point for one in standing if one.point is not None]


def _whole(cell: Cell, model: CollisionModel | None, standing: Sequence[Standing]) -> PathClearance | None:
    """The check of the whole path of arms that are there."""
    if model is None:
        return None
    points = _points(standing)
    bases = np.stack([one.arm.base_in_world(p.position, p.yaw) for one, p in zip(standing, points, strict=True)])
    return check_clearance(cell, model, cell.surroundings.clearances, bases, [point.joints for point in points])


def _passes(path: PathClearance | None) -> bool:
    return path is None or (path.clear and path.limit_excess <= LIMITS)
