"""Link frames against Pinocchio's joint placements."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from duocell.models.catalogue import catalogue
from duocell.models.kinematics.kinematics import pinocchio_model
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.robot import Robot
from tests.support.given.arms import general_six, oblique_wrist

ROBOTS = [catalogue.robot(name) for name in catalogue.names()] + [general_six(), oblique_wrist()]


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_frames_are_those_of_pinocchio(robot: Robot) -> None:
    q = np.random.default_rng(3).uniform(-6.0, 6.0, (4, robot.dof))
    frames = link_frames(robot, q)
    assert np.array_equal(frames[:, 0], np.tile(np.eye(4), (4, 1, 1)))
    model = pinocchio_model(robot)
    data = model.createData()
    for row, placed in zip(q, frames, strict=True):
        pin.forwardKinematics(model, data, row)
        for i in range(1, robot.dof + 1):
            assert np.abs(placed[i] - data.oMi[i].homogeneous).max() < 1e-12
