"""Between the poses: the object's way, and arms that follow it without leaving their branch."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.pose import interpolate_rotations, rotation_about, rotation_angle, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.kinematics import flange_poses
from duocell.optimizer.clearance.path_samples import ObjectPath, follow

ARMS = ["puma560", "ur10e", "lrmate200id", "fanuc_crx10ia", "iiwa14", "franka_panda"]


def test_the_object_moves_straight_and_turns_the_short_way() -> None:
    rng = np.random.default_rng(0)
    turns = rotation_about([1.0, 2.0, -1.0], rng.uniform(-1.0, 1.0, 5))
    poses = transform(turns, rng.uniform(-1.0, 1.0, (5, 3)))
    path = ObjectPath(poses)
    steps, fractions = np.repeat(np.arange(4), 7), np.tile(np.linspace(0.0, 1.0, 7), 4)
    found = path.at(steps, fractions)
    for step in range(4):
        some = found[steps == step]
        shares = np.linspace(0.0, 1.0, 7)
        start, end = poses[step : step + 2, :3, :3]
        assert np.allclose(some[:, :3, :3], interpolate_rotations(start, end, shares), atol=1e-9)
        straight = (1 - shares)[:, None] * poses[step, :3, 3] + shares[:, None] * poses[step + 1, :3, 3]
        assert np.allclose(some[:, :3, 3], straight, atol=1e-12)


def test_a_pure_shift_does_not_turn() -> None:
    path = ObjectPath(transform(np.eye(3), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    assert np.allclose(path.at(np.array([0]), np.array([0.3])), transform(np.eye(3), [[0.3, 0.0, 0.0]]))


@pytest.mark.parametrize("name", ARMS)
def test_followed_joints_reach_the_poses_between_their_neighbours(name: str) -> None:
    robot = catalogue.robot(name)
    rng = np.random.default_rng(1)
    base = transform(rotation_z(0.7), [0.3, -0.2, 0.1])
    before = robot.reference + rng.uniform(-0.3, 0.3, (40, robot.dof))
    after = before + rng.uniform(-0.08, 0.08, before.shape)
    ends = [base @ flange_poses(robot, q) for q in (before, after)]
    middles = np.concatenate(
        [ObjectPath(np.stack(pair)).at(np.array([0]), np.array([0.5])) for pair in zip(*ends, strict=True)]
    )
    q, good = follow(robot, base, middles, before, after)
    assert np.mean(good) > 0.8
    reached = base @ flange_poses(robot, q[good])
    assert np.abs(reached[:, :3, 3] - middles[good][:, :3, 3]).max() < 1e-7
    assert rotation_angle(reached[:, :3, :3].swapaxes(1, 2) @ middles[good][:, :3, :3]).max() < 1e-7
    assert np.abs(q - 0.5 * (before + after))[good].max() < 0.2


def test_a_pose_out_of_reach_is_not_followed() -> None:
    robot = catalogue.robot("puma560")
    q = robot.reference[None] + 0.2
    far = transform(np.eye(3), [[5.0, 0.0, 0.0]])
    _, good = follow(robot, np.eye(4), far, q, q)
    assert not good[0]
