"""Proofs on the arm that was drawn hold for the arm that is meant: their room for what the two are apart is needed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from models.branches import posture_terms
from models.catalogue import robot
from models.cell import Cell
from models.closed_form import ClosedForm, closed_form
from models.kinematics import flange_poses
from models.nominal import nominal
from models.pose import rotation_x
from models.robot import Robot
from models.task import Task
from optimizer.certificate.bounds.box_bounds import BoxBounder
from optimizer.certificate.bounds.boxes import Boxes
from optimizer.reduced import reduced_problem
from tests.support.arms import make_arm, region

TILT = 2e-8
"""rad of joint axes 2 and 4, as files with eight digits have them."""


def tilted() -> Robot:
    """A PUMA whose numbers are rounded."""
    drawn = robot("puma560")
    axes = np.array(drawn.joint_axes)
    axes[[1, 3]] = axes[[1, 3]] @ rotation_x(TILT).T
    return replace(drawn, name="tilted", joint_axes=axes, flanges=())


def stretched(form: ClosedForm, joints: np.ndarray) -> np.ndarray:
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
    form = closed_form(meant.robot)
    assert form is not None
    apart, denied = max(meant.position, meant.angle), 0
    for seed in range(12):
        joints = stretched(form, np.random.default_rng(seed).uniform(-1.0, 1.0, 6))
        arm = make_arm("puma560", base=region(0.0, 0.0, 0.0, 0.0), lower=joints - 1e-9, upper=joints + 1e-9)
        arm = replace(arm, robot=meant.robot, reference=joints, avoid_singularities=False)
        cell = Cell(Task(flange_poses(tilted(), joints[None])), (arm,), np.pi)
        found = []
        for room in (apart, 0.0):
            problem = reduced_problem(cell, arm, room)
            assert problem is not None
            boxes = Boxes(np.zeros((8, 3)), np.zeros((8, 3)), np.arange(8))
            found.append(np.isfinite(BoxBounder.of(problem, checks).bounds(boxes, np.inf).lower).any())
        assert found[0]
        denied += not found[1]
    assert checks or denied > 0  # without the room some would have been
