"""What no base can help is found before anything is searched, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, Part, Pedestal, Surroundings
from duocell.models.cell.task import line
from duocell.models.geometry.shapes import Body, Box, Sphere
from duocell.optimizer.infeasibility.searched.obstructed import obstruction
from duocell.optimizer.results.layout import Reason
from tests.support.given.arms import region
from tests.support.given.fields import SurroundingsFields
from tests.support.given.tasks import Possible, possible


def cell_with(**around: Unpack[SurroundingsFields]) -> tuple[Cell, Possible]:
    task = possible("puma560", np.random.default_rng(2), poses=4)
    return replace(task.cell, surroundings=Surroundings(**around)), task


def test_a_part_that_hits_something_on_its_way_is_a_proof() -> None:
    start, end = (transform(np.eye(3), [x, 0.0, 0.3]) for x in (0.0, 0.9))
    way = line(start, end, 4)
    between = 0.5 * (way.poses[1, :3, 3] + way.poses[2, :3, 3])
    part = Part((Body("part", np.eye(4), Sphere(0.02)),))
    for gap, blocked in ((0.01, True), (0.2, False)):
        post = Body("post", transform(np.eye(3), between + np.array([0.0, 0.0, 0.04 + gap])), Sphere(0.02))
        cell, _ = cell_with(obstacles=(post,), part=part, clearances=Clearances(part_obstacle=0.02))
        reasons = obstruction(replace(cell, task=way))
        assert bool(reasons) == blocked
        if blocked:
            assert reasons[0].kind == "collision"
            assert "post" in reasons[0].detail
            assert reasons[0].poses == (1,)
            assert reasons[0].amount == pytest.approx(0.01, abs=1e-4)


def test_without_a_clearance_nothing_is_asked() -> None:
    _, task = cell_with()
    wall = Body("wall", task.cell.task.poses[0], Box(np.array([1.0, 1.0, 1.0])))
    cell, _ = cell_with(obstacles=(wall,), part=Part((Body("part", np.eye(4), Sphere(0.02)),)))
    assert obstruction(cell) == ()


def test_a_floor_without_room_is_a_proof_for_the_arm_that_needs_it() -> None:
    cell, task = cell_with()
    x, y = task.position[:2]
    arm = replace(cell.arms[0], base=region((x - 0.2, x + 0.2), (y - 0.2, y + 0.2), float(task.position[2])))
    cell = replace(cell, arms=(arm,))
    around = np.array([[x - 0.5, y - 0.5], [x + 0.5, y - 0.5], [x + 0.5, y + 0.5], [x - 0.5, y + 0.5]])

    def asked(floor: Floor, footprint: Footprint | None = None) -> tuple[Reason, ...]:
        pedestal = None if footprint is None else Pedestal(0.3, footprint)
        surroundings = Surroundings(floor=floor, equipment={arm.name: Equipment(pedestal=pedestal)})
        return obstruction(replace(cell, surroundings=surroundings))

    assert asked(Floor(around)) == ()
    assert asked(Floor(around), Footprint.disc(0.29)) == ()
    assert asked(Floor(around), Footprint.disc(0.51))[0].kind == "floor"
    assert asked(Floor(None, (around,)))[0].arm == arm.name
    assert asked(Floor(around + 5.0))
    fixed = replace(cell, arms=(replace(arm, base=region(float(x), float(y), float(task.position[2]))),))
    free = Surroundings(floor=Floor(around))
    assert obstruction(replace(fixed, surroundings=free)) == ()  # a point has no area, but stands
