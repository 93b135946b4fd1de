"""A base is called impossible only after every combination of postures: what the cheapest hits, another may clear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.posture import ALL_SIGNS, Posture, Signs, name_signs
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.results.layout import Layout, Outcome
from tests.optimizer.evaluation.test_evaluate import of_scene
from tests.support.given.cells import beam_pair
from tests.support.present import present


def blocks(cell: Cell, layout: Layout, count: int) -> Cell:
    """The cell with a small block in the elbow of each of the first arms."""
    elbows = []
    for arm, placement in zip(cell.arms[:count], layout.placements, strict=False):
        base = arm.base_in_world(placement.position, placement.yaw)
        elbows.append((base @ link_frames(arm.robot, placement.joints[:1])[0, 3])[:3, 3])
    around = cell.surroundings
    made = tuple(Body(f"block {k}", _at(place), Box(np.full(3, 0.02))) for k, place in enumerate(elbows))
    obstacles = (*around.obstacles, *made)
    return replace(cell, surroundings=replace(around, obstacles=obstacles, clearances=Clearances(arm_obstacle=0.0)))


def _at(place: Floats) -> Floats:
    pose = np.eye(4)
    pose[:3, 3] = place
    return pose


def in_postures(cell: Cell, chosen: tuple[Signs, Signs]) -> Cell:
    arms = zip(cell.arms, chosen, strict=True)
    return replace(cell, arms=tuple(replace(arm, posture=Posture(*signs)) for arm, signs in arms))


@pytest.mark.parametrize("count", [1, 2])
def test_the_cheapest_clean_combination_is_that_of_trying_them_one_by_one(count: int) -> None:
    cell = of_scene(beam_pair("ur10e", count=3))
    free = replace(cell, surroundings=replace(cell.surroundings, clearances=Clearances()))
    cheapest = evaluate_layout(free)
    assert cheapest.outcome is Outcome.FEASIBLE
    blocked = blocks(cell, cheapest, count)
    found = evaluate_layout(blocked)
    alone = []
    for first in ALL_SIGNS:
        for second in ALL_SIGNS:
            one = evaluate_layout(in_postures(blocked, (first, second)))
            if one.outcome is Outcome.FEASIBLE:
                alone.append((present(one.objective), [name_signs(first), name_signs(second)]))
    own = evaluate_layout(blocked, [placement.joints for placement in cheapest.placements])
    assert own.outcome is Outcome.INFEASIBLE
    if not alone:
        assert found.outcome is Outcome.INFEASIBLE
        return
    best = min(alone, key=lambda pair: pair[0])
    assert found.outcome is Outcome.FEASIBLE
    assert found.objective == pytest.approx(best[0], rel=1e-12)
    assert [placement.posture for placement in found.placements] == best[1]
    assert present(found.objective) > present(cheapest.objective)
