"""What proofs know of an arm's bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Ints
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, Part, Pedestal, Surroundings
from duocell.models.cell.task import Task
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.shapes import Body, Box
from duocell.models.robot.arm import FREE_YAW, Arm
from duocell.optimizer.certificate.exclusion.bodies import ArmBodies
from duocell.optimizer.certificate.exclusion.causes import Causes
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Outcome
from duocell.optimizer.settings import Settings
from tests.support.given.arms import make_arm, region

FOOT, LOW, HIGH = 0.6, 0.7, 1.8
"""m, of a pedestal on a shelf and of the heights that its base may have."""


def below_a_shelf(z: float | tuple[float, float]) -> tuple[Arm, Cell]:
    """A UR10e on a shelf that carries a beam which reaches below the shelf."""
    pedestal = Pedestal(np.max(z) - FOOT, Footprint.disc(0.1), FOOT)
    arm = make_arm("ur10e", base=region(x=0.0, y=0.0, z=z, yaw=FREE_YAW if isinstance(z, tuple) else 0.0))
    grasp = np.diag([1.0, -1.0, -1.0, 1.0])
    beam = Body("beam", transform(np.eye(3), [-0.5, 0.0, -0.03]), Box(np.array([1.6, 0.1, 0.05])))
    block = Body("block", transform(np.eye(3), [3.0, 0.0, 0.0]), Box(np.full(3, 0.1)))
    around = Surroundings(
        obstacles=(block,),
        part=Part((beam,), 0.15),
        clearances=Clearances(arm_part=0.0, arm_obstacle=0.0, self_collision=0.0),
        equipment={"arm": Equipment(pedestal=pedestal)},
    )
    arm = replace(arm, grasp=grasp)
    poses = np.stack([transform(np.eye(3), [0.95, 0.0, height]) for height in (0.33, 0.34)])
    return arm, Cell(Task(poses), (arm,), surroundings=around)


def test_points_of_a_pedestal_below_its_foot_count_against_obstacles_alone() -> None:
    arm, cell = below_a_shelf((LOW, HIGH))
    model = CollisionModel(cell.arms, cell.surroundings)
    bodies = ArmBodies.of(model, 0, np.zeros(len(model.bodies.first)), Causes.of(arm.robot, model, 0))
    number = model.bodies.names.index("arm pedestal")

    def lowest_of(points: Ints) -> float:
        own = points[bodies.base_points.body[points] == number]
        return float(np.min(bodies.base_points.place[own, 2]))

    for other in bodies.base_others:
        assert lowest_of(other.points) == pytest.approx(-(LOW if other.part else HIGH) + FOOT, abs=1e-3)
    assert all(
        lowest_of(pair.points) > FOOT - LOW
        for pair in bodies.base_pairs
        if number in bodies.base_points.body[pair.points]
    )
    assert np.min(bodies.capsules.ends[bodies.capsules.body == number][..., 2]) > FOOT - LOW


def test_what_a_base_of_one_height_can_do_is_never_proved_impossible_for_several() -> None:
    _, fixed = below_a_shelf(LOW)
    assert evaluate_layout(fixed).outcome is Outcome.FEASIBLE
    _, free = below_a_shelf((LOW, HIGH))
    assert optimize(free, Settings(time_limit=60.0)).outcome is not Outcome.INFEASIBLE
