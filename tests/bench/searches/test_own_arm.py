"""Our own inverse finds the posture that Pinocchio was given, and nothing that Pinocchio does not confirm."""

from __future__ import annotations

import numpy as np
import pytest

from bench.searches.own_arm import forward, inverse, own_arm
from duocell.models.catalogue.catalogue import robot
from duocell.models.kinematics.kinematics import flange_poses


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900", "lrmate200id", "fanuc_m710ic", "irb120"])
def test_there_and_back(name: str) -> None:
    chosen = robot(name)
    arm = own_arm(chosen)
    assert arm is not None
    given = np.random.default_rng(3).uniform(-2.5, 2.5, (60, 6))
    poses = flange_poses(chosen, given)
    np.testing.assert_allclose(forward(arm, given), poses, atol=1e-12)
    joints, exist = inverse(arm, poses[:, :3, :3], poses[:, :3, 3])
    reached = flange_poses(chosen, joints[exist])
    np.testing.assert_allclose(reached, np.broadcast_to(poses, (8, *poses.shape))[exist], atol=1e-7)
    apart = np.abs((joints - given + np.pi) % (2.0 * np.pi) - np.pi).max(axis=-1)
    assert np.all(np.where(exist, apart, np.inf).min(axis=0) < 1e-6)


@pytest.mark.parametrize("name", ["iiwa14", "fanuc_crx10ia"])
def test_other_arms_are_refused(name: str) -> None:
    assert own_arm(robot(name)) is None
