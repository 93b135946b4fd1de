"""What blocks a cell is a set that is proved, and what is told to help has a layout."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

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
from optimizer.why_not.trial import find
from tests.support.arms import make_arm, region

LONG = 300.0
"""s; no test waits for it."""
HOLD = Task(np.tile(transform(np.diag([1.0, -1.0, -1.0]), [0.0, 0.0, 0.5]), (2, 1, 1)))


def explained(cell: Cell):
    answer = refused(cell, (), LONG)
    return explain(cell, answer, 0, time.perf_counter() + LONG)


def test_a_self_distance_that_is_not_possible_is_answered_with_the_largest_that_is():
    arm = make_arm("ur10e", "arm", base=region((-3, 3), (-3, 3), (0, 0)))
    cell = Cell(HOLD, (arm,), surroundings=Surroundings(clearances=Clearances(self_collision=0.016)))
    found = explained(cell)
    assert "self-collision" in found.blocking
    assert [r.what for r in found.relaxations] == ["ask for 14.7 mm instead of 16 mm of self clearance"]
    less = replace(cell, surroundings=Surroundings(clearances=Clearances(self_collision=0.0147)))
    hints = find(less, time.perf_counter() + LONG).found
    assert hints is not None
    assert hints.objective == pytest.approx(found.relaxations[0].objective, rel=1e-6)


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
    assert set(found.blocking) == {"poses 0-1", "part", "obstacle post"}
    assert found.irreducible
    (moved,) = found.relaxations
    assert moved.pointer == "/obstacles/0/pose/position"
    amount = float(moved.what.split(" by ")[1].split(" mm")[0])
    assert 40.0 <= amount <= 43.0  # the part ends at 50 mm and the post begins at 20 mm; 10 mm are asked for
