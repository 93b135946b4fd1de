"""Proofs on the arm that was drawn hold for the arm that is meant: their room for what the two are apart is needed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import posture_of, posture_terms
from duocell.models.kinematics.closed_form import ClosedForm
from duocell.models.kinematics.difference import SAME
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.nominal import nominal
from duocell.models.robot.posture import ALL_SIGNS
from duocell.models.robot.robot import Robot
from duocell.optimizer.certificate.bounds.box_bounds import BoxBounder
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.single_arm.as_drawn import problem_of_drawing
from tests.models.kinematics.test_nominal import calibrated
from tests.support.given.arms import form_of, make_arm, region
from tests.support.present import present

TILT = 2e-8
"""rad of joint axes 2 and 4, as files with eight digits have them."""


def tilted() -> Robot:
    """A PUMA whose numbers are rounded."""
    drawn = robot("puma560")
    axes = np.array(drawn.joint_axes)
    axes[[1, 3]] = axes[[1, 3]] @ rotation_x(TILT).T
    return replace(drawn, name="tilted", joint_axes=axes, flanges=())


def stretched(form: ClosedForm, joints: Floats) -> Floats:
    """The joints with the elbow all but stretched (of the drawing)."""

    def bend(third: float) -> float:
        return float(posture_terms(form, np.array([*joints[:2], third, *joints[3:]]), np.sin, np.cos)[1])

    places = np.linspace(-1.5, 3.0, 40)
    low = next(i for i in range(39) if bend(places[i]) * bend(places[i + 1]) < 0.0)
    third = brentq(bend, places[low], places[low + 1]) + 1e-5
    return np.array([*joints[:2], third, *joints[3:]])


@pytest.mark.parametrize("checks", [False, True])
def test_joints_of_the_meant_arm_are_never_called_impossible(checks: bool) -> None:
    """Limits hold the joints of the meant arm exactly; the base is where it stands, the elbow all but stretched."""
    meant = nominal(tilted())
    assert meant is not None
    assert meant.negligible
    form = form_of(meant.robot)
    denied = 0
    for seed in range(12):
        joints = stretched(form, np.random.default_rng(seed).uniform(-1.0, 1.0, 6))
        arm = make_arm("puma560", base=region(0.0, 0.0, 0.0, 0.0), lower=joints - 1e-9, upper=joints + 1e-9)
        arm = replace(arm, robot=meant.robot, reference=joints, avoid_singularities=False)
        cell = Cell(Task(flange_poses(tilted(), joints[None])), (arm,), np.pi)
        found = []
        for room in (meant.apart, SAME):
            problem = present(reduced_problem(cell, arm, room))
            boxes = Boxes(np.zeros((8, 3)), np.zeros((8, 3)), np.arange(8))
            found.append(np.isfinite(BoxBounder.of(problem, checks).bounds(boxes, np.inf).lower).any())
        assert found[0]
        denied += not found[1]
    assert checks or denied > 0  # without the room some would have been


@pytest.mark.parametrize("name", ["ur10e", "puma560", "irb120"])
@pytest.mark.parametrize("checks", [False, True])
def test_a_calibrated_arm_costs_no_less_than_the_bound_of_its_drawing_where_it_stands(name: str, checks: bool) -> None:
    """Any joints of the true arm, whose hand is where they take it: limits hold them exactly, and they are not lost."""
    beaten = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        true = calibrated(name, 1e-3, 1e-3, seed)
        meant = nominal(true)
        assert meant is not None
        joints = rng.uniform(-2.5, 2.5, 6) + rng.normal(size=(3, 6)) * 0.05
        tight = rng.random() < 0.5
        room = (1e-9 if tight else 0.3) * np.ones(6)
        low, high = np.min(joints, axis=0) - room, np.max(joints, axis=0) + room
        arm = make_arm(true, base=region(0.0, 0.0, 0.0, 0.0), lower=low, upper=high, reference=joints[0] + 0.2)
        arm = replace(arm, avoid_singularities=False)
        form = form_of(meant.robot)
        if len({posture_of(form, q) for q in joints}) > 1:
            continue
        cell = Cell(Task(flange_poses(true, joints)), (arm,), np.pi)
        cost = objective_of(cell, arm, joints)
        posture = np.array([ALL_SIGNS.index(posture_of(form, joints[0]))])
        for drawing in (meant, replace(meant, apart=SAME)):
            problem = problem_of_drawing(cell, arm, drawing)
            assert problem is not None
            for half in (0.0, 1e-3, 0.05):
                place = np.zeros((1, 3)) + (rng.uniform(-half, half, 3) if half else 0.0)
                boxes = Boxes(place, np.full((1, 3), half), posture)
                lower = float(BoxBounder.of(problem, checks).bounds(boxes, np.inf).lower[0])
                if drawing is meant:
                    assert lower <= cost * (1.0 + 1e-9)
                else:
                    beaten += lower > cost * (1.0 + 1e-9)
    assert beaten > 0  # without the room some bounds would be wrong
