"""Conditioning of an arm that another one stands for: the room that proofs leave for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import posture_of
from duocell.models.kinematics.difference import SAME
from duocell.models.kinematics.kinematics import characteristic_length, flange_poses
from duocell.models.kinematics.nominal import nominal
from duocell.models.robot.posture import ALL_SIGNS
from duocell.models.robot.robot import Robot
from duocell.optimizer.certificate.bounds.box_bounds import BoxBounder
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.conditioning import jacobian_apart, poorly_conditioned
from duocell.optimizer.single_arm.as_drawn import problem_of_drawing
from tests.models.kinematics.test_nominal import calibrated
from tests.support.given.arms import form_of, make_arm, region
from tests.support.oracles.signs import joint_axes

TOOL = transform(np.eye(3), np.array([0.05, -0.1, 0.2]))


def singular_values(robot: Robot, joints: Floats) -> Floats:
    """(K, 6) of the Jacobian at the tool, linear rows divided by the characteristic length."""
    axes, points = joint_axes(robot, joints)
    tool = (flange_poses(robot, joints) @ TOOL)[:, :3, 3]
    linear = np.cross(axes, tool - points) / characteristic_length(robot)
    return np.linalg.svd(np.concatenate([linear, axes], axis=2).swapaxes(0, 1), compute_uv=False)


@pytest.mark.parametrize("name", ["ur10e", "puma560"])
@pytest.mark.parametrize("size", [1e-5, 1e-3])
def test_singular_values_differ_by_no_more_than_is_left_for_them(name: str, size: float) -> None:
    for seed in range(5):
        true = calibrated(name, size, size, seed)
        meant = nominal(true)
        assert meant is not None
        q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (500, 6))
        apart = np.abs(singular_values(true, q) - singular_values(meant.robot, q)).max()
        bound = jacobian_apart(make_arm(meant.robot, tool=TOOL), meant.apart)
        assert 0.0 < apart <= bound < 100.0 * apart
    assert jacobian_apart(make_arm(name, tool=TOOL), SAME) == 0.0


def test_no_conditioning_that_the_arm_itself_has_is_called_impossible() -> None:
    wrong = 0
    for seed in range(12):
        true = calibrated("ur10e", 1e-4, 1e-4, seed)
        meant, rng = nominal(true), np.random.default_rng(seed)
        assert meant is not None
        joints = rng.uniform(-2.0, 2.0, (1, 6))
        sigma = singular_values(true, joints)[0]
        arm = make_arm(true, tool=TOOL, base=region(0.0, 0.0, 0.0, 0.0), reference=joints[0])
        arm = replace(arm, avoid_singularities=False, min_conditioning=float(sigma[-1] / sigma[0]))
        cell = Cell(Task(flange_poses(true, joints) @ TOOL), (arm,), np.pi)
        form = form_of(meant.robot)
        boxes = Boxes(np.zeros((1, 3)), np.zeros((1, 3)), np.array([ALL_SIGNS.index(posture_of(form, joints[0]))]))
        for drawing in (meant, replace(meant, apart=SAME)):
            problem = problem_of_drawing(cell, arm, drawing)
            assert problem is not None
            lost = bool(np.any(poorly_conditioned(problem, BoxBounder.of(problem).kinematics, boxes)))
            assert not (lost and drawing is meant)
            wrong += lost
    assert wrong > 0  # without the room some would have been
