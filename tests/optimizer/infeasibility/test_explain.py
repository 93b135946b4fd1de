"""What blocks a cell is a set that is proved, and what is told to help has a layout."""

from __future__ import annotations

import time

import numpy as np

from bench.draws.cells import real_cell
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances, Part, Surroundings
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.explain import explain
from duocell.optimizer.infeasibility.immediate.immediate import refused
from duocell.optimizer.infeasibility.proved_conflict import Conflict, proved_conflict
from duocell.optimizer.infeasibility.requirements import Kind
from duocell.optimizer.infeasibility.searched.trial import clean
from duocell.optimizer.results.findings import Explanation
from duocell.optimizer.verification.scene import Scene
from tests.support.given.arms import make_arm, region
from tests.support.present import present

LONG = 300.0
"""s; no test waits for it."""
HOLD = Task(np.tile(transform(np.diag([1.0, -1.0, -1.0]), [0.0, 0.0, 0.5]), (2, 1, 1)))


def explained(cell: Cell) -> Explanation:
    answer = refused(cell, (), LONG)
    found = explain(cell, answer, 0, time.perf_counter() + LONG)
    assert isinstance(found, Explanation)
    return found


def test_a_self_distance_that_is_not_possible_is_answered_with_the_largest_that_is() -> None:
    arm = make_arm("ur10e", "arm", base=region((-1, 1), (-1, 1), (0, 0)))
    cell = Cell(HOLD, (arm,), surroundings=Surroundings(clearances=Clearances(self_collision=0.016)))
    found = explained(cell)
    assert "self-collision" in found.blocking
    assert found.relaxations[0].pointer == "/clearance/self"
    amount = float(found.relaxations[0].what.split("ask for ")[1].split(" mm")[0])
    assert 14.3 <= amount <= 14.75  # no posture keeps more


def test_a_wall_that_stands_in_the_way_is_needed_for_the_proof_and_nothing_else_is() -> None:
    cell = real_cell(93).cell
    first = proved_conflict(cell, Effort(LONG, np.inf))
    assert isinstance(first, Conflict)
    found = present(first.finish)(Effort(LONG, np.inf))
    assert found.irreducible
    assert found.selection.first == found.selection.last  # no more poses than it takes
    obstacles = [e.index for e in found.selection.requirements if e.kind is Kind.OBSTACLE]
    assert [cell.surroundings.obstacles[k].name for k in obstacles] == ["wall"]


def test_a_cell_with_a_layout_has_no_conflict() -> None:
    cell = real_cell(8).cell
    found = proved_conflict(cell, Effort(8.0, np.inf))
    assert not isinstance(found, Conflict)
    assert found is None or clean(Scene.of(cell), found)


def test_a_box_over_the_part_is_named_and_moved_no_farther_than_needed() -> None:
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
