"""Way-point tasks are made around paths that keep what is asked for."""

from __future__ import annotations

import numpy as np
import pytest

from bench.trials.waypoints import ROBOTS, STEP, summary, way_task
from duocell.models.kinematics.kinematics import flange_poses


@pytest.mark.parametrize("seed", range(4))
def test_the_drawn_path_does_the_task(seed: int) -> None:
    task = way_task(seed)
    arm = task.cell.arms[0]
    assert arm.robot.name == ROBOTS[seed]
    np.testing.assert_allclose(flange_poses(arm.robot, task.joints), task.cell.task.poses, atol=1e-12)
    assert np.abs(np.diff(task.joints, axis=0)).max() < STEP
    assert np.all((arm.lower < task.joints) & (task.joints < arm.upper))
    np.testing.assert_array_equal(way_task(seed).joints, task.joints)


def test_what_is_printed() -> None:
    record = {"robot": "gen3", "word": "infeasible", "cpu": 1.0}
    assert "| gen3 | 1 | 1 | 0 | 0 | 1 |" in summary([record])
