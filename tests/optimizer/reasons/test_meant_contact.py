"""Contact that is not allowed says which setting allows it, and that setting does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances, PairClass, Part, Surroundings
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reasons.meant_contact import if_meant
from tests.support.given.arms import make_arm, only_at, region

LIFT = Task(np.array([transform(np.diag([1.0, -1.0, -1.0]), [0.7, 0.0, z]) for z in (0.5, 0.55, 0.6)]))
BLOCK = Part((Body("part", np.eye(4), Box(np.array([0.1, 0.1, 0.1]))),))
CONVEYOR = Body("conveyor", transform(np.eye(3), [0.7, 0.0, 0.25]), Box(np.array([0.3, 0.3, 0.4])))


def lying(sunk: float, clearance: float | None) -> Cell:
    """A block that is lifted from a conveyor, into which it is sunk at first [m]."""
    arm = make_arm("ur10e", "arm", base=region((-1, 1), (-1, 1), (0, 0)))
    raised = replace(CONVEYOR, pose=transform(np.eye(3), [0.7, 0.0, 0.25 + sunk]))
    around = Surroundings((raised,), BLOCK, None, Clearances(part_obstacle=clearance))
    return Cell(LIFT, (arm,), surroundings=around)


@pytest.mark.parametrize(
    ("sunk", "clearance", "words"), [(0.0, 0.02, "the part touches conveyor"), (0.003, 0.0, "the part penetrates 3 mm")]
)
def test_a_part_that_lies_on_a_conveyor_is_told_which_setting_helps(sunk: float, clearance: float, words: str) -> None:
    (reason,) = optimize(lying(sunk, clearance)).reasons
    assert reason.kind == "collision"
    assert reason.detail.startswith(words)
    assert "clearance.part_obstacle to null" in reason.detail
    assert optimize(lying(sunk, None)).usable


def test_arms_that_hit_obstacles_are_told_of_no_such_setting() -> None:
    assert if_meant(PairClass.ARM_OBSTACLE) == if_meant(PairClass.ARM_ARM) == if_meant(PairClass.SELF) == ""
    assert "part.grasp_zone" in if_meant(PairClass.ARM_PART)


def test_an_evaluation_tells_it_too() -> None:
    found = optimize(lying(0.003, None))
    (placed,) = found.placements
    cell = lying(0.003, 0.0)
    fixed = only_at(placed.position, placed.yaw)
    given = evaluate_layout(replace(cell, arms=(replace(cell.arms[0], base=fixed),)))
    assert any("clearance.part_obstacle to null" in reason.detail for reason in given.reasons)


def test_a_part_that_no_arm_holds_without_reaching_into_it_is_told_which_setting_helps() -> None:
    tall = Part((Body("part", np.eye(4), Box(np.array([0.3, 0.2, 0.9]))),))
    arm = make_arm("ur10e", "arm", base=region((-1, 1), (-1, 1), (0, 0)))
    cell = Cell(LIFT, (arm,), surroundings=Surroundings((), tall, None, Clearances(arm_part=0.0)))
    found = optimize(cell)
    assert not found.usable
    assert any("part.grasp_zone" in reason.detail for reason in found.reasons)
