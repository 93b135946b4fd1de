"""Newton from many seeds against Pinocchio, ssik and the closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.branches import solve_branches
from duocell.models.kinematics.inverse import REACHED
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses
from duocell.models.kinematics.numeric_inverse import numeric_branches
from duocell.models.robot.robot import Robot
from tests.support.angles import wrapped
from tests.support.given.arms import form_of, general_six, random_joints


def poses_of(name: str, count: int, margin: float = 0.05) -> tuple[Robot, Floats, Floats]:
    """Well-conditioned joint values and their poses."""
    robot = catalogue.robot(name)
    joints = random_joints(robot, 50 * count, np.random.default_rng(21))
    joints = joints[conditioning(robot, np.eye(4), joints, characteristic_length(robot)) > margin][:count]
    assert len(joints) == count
    return robot, joints, flange_poses(robot, joints)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "fanuc_crx10ia", "iiwa14", "yumi_left", "xarm6"])
def test_every_branch_reaches_the_pose_and_is_listed_once(name: str) -> None:
    robot, _, poses = poses_of(name, 3)
    for pose in poses:
        found = numeric_branches(robot, pose)
        assert len(found) > 0
        assert np.abs(flange_poses(robot, found) - pose).max() < 1e-9
        assert np.abs(found).max() <= np.pi
        apart = np.abs(wrapped(found[:, None] - found[None])).max(axis=-1)
        assert np.all(apart[~np.eye(len(found), dtype=bool)] > 1e-4)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900"])
def test_all_branches_of_the_closed_forms_are_found(name: str) -> None:
    robot, _, poses = poses_of(name, 3, 0.1)
    form = form_of(robot)
    for pose in poses:
        every = solve_branches(form, pose[None, :3, :3], pose[None, :3, 3])
        expected = every.joints[:, every.missing[:, 0] < REACHED, 0].T
        found = numeric_branches(robot, pose)
        assert len(found) == len(expected)
        for branch in expected:
            assert np.abs(wrapped(found - branch)).max(axis=1).min() < 1e-6


def test_a_pose_out_of_reach_has_none() -> None:
    pose = np.eye(4)
    pose[:3, 3] = 5.0
    assert numeric_branches(general_six(), pose).shape == (0, 6)


def test_answers_are_the_same_every_time() -> None:
    robot, _, poses = poses_of("fanuc_crx10ia", 1)
    assert np.array_equal(numeric_branches(robot, poses[0]), numeric_branches(robot, poses[0]))


def test_half_a_turn_of_orientation_error_does_not_stop_the_iteration() -> None:
    """The rotation error of 180° has no direction in its skew part; some seeds start there."""
    robot, joints, poses = poses_of("ur5e", 5, 0.1)
    for own, pose in zip(joints, poses, strict=True):
        found = numeric_branches(robot, pose)
        assert np.abs(wrapped(found - own)).max(axis=1).min() < 1e-6
