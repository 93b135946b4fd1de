"""What blocks a cell is a set that is proved, and what is told to help has a layout."""

from __future__ import annotations

import time

import numpy as np

from bench.cells import real_cell
from models.cell import Cell
from models.pose import transform
from models.shapes import Body, Box
from models.surroundings import Clearances, Part, Surroundings
from models.task import Task
from optimizer.coupled.scene import Scene
from optimizer.infeasibility.arm_conflict import arm_conflict, proved_arm
from optimizer.infeasibility.explain import explain
from optimizer.infeasibility.immediate import refused
from optimizer.why_not.elements import Kind
from tests.support.arms import make_arm, region

LONG = 300.0
"""s; no test waits for it."""
HOLD = Task(np.tile(transform(np.diag([1.0, -1.0, -1.0]), [0.0, 0.0, 0.5]), (2, 1, 1)))


def explained(cell: Cell):
    answer = refused(cell, (), LONG)
    return explain(cell, answer, 0, time.perf_counter() + LONG)


def test_a_self_distance_that_is_not_possible_is_answered_with_the_largest_that_is():
    arm = make_arm("ur10e", "arm", base=region((-1, 1), (-1, 1), (0, 0)))
    cell = Cell(HOLD, (arm,), surroundings=Surroundings(clearances=Clearances(self_collision=0.016)))
    found = explained(cell)
    assert "self-collision" in found.blocking
    assert found.relaxations[0].pointer == "/clearance/self"
    amount = float(found.relaxations[0].what.split("ask for ")[1].split(" mm")[0])
    assert 14.3 <= amount <= 14.75  # no posture keeps more


def test_a_wall_that_stands_in_the_way_is_needed_for_the_proof_and_nothing_else_is():
    cell = real_cell(93).cell
    found = arm_conflict(cell, time.perf_counter() + LONG)
    assert found is not None
    assert found.irreducible
    obstacles = [e.index for e in found.selection.elements if e.kind is Kind.OBSTACLE]
    assert [cell.surroundings.obstacles[k].name for k in obstacles] == ["wall"]


def test_a_cell_with_a_layout_has_no_arm_conflict():
    made = real_cell(8)
    assert proved_arm(made.cell, time.perf_counter() + 20.0) is None
    assert Scene.of(made.cell).model is not None


def test_a_box_over_the_part_is_named_and_moved_no_farther_than_needed():
    arm = make_arm("ur5e", "arm", base=region((-0.6, 0.6), (-0.6, 0.6), (0, 0)))
    part = Body("part", np.eye(4), Box(np.array([0.1, 0.1, 0.1])))
    post = Body("post", transform(np.eye(3), [0.07, 0.0, 0.5]), Box(np.array([0.1, 0.1, 0.02])))

    around = Surroundings((post,), Part((part,)), None, Clearances(part_obstacle=0.01))
    found = explained(Cell(HOLD, (arm,), surroundings=around))
    assert set(found.blocking) == {"pose 0", "part", "obstacle post"}
    assert found.irreducible
    (moved,) = found.relaxations
    assert moved.pointer == "/obstacles/0/pose/position"
    amount = float(moved.what.split(" by ")[1].split(" mm")[0])
    assert 40.0 <= amount <= 43.0  # the part ends at 50 mm and the post begins at 20 mm; 10 mm are asked for
