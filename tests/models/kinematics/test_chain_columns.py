"""Many postures by columns: the same frames and Jacobians as by screws, and as by Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.catalogue.catalogue import robot
from duocell.models.kinematics.batch_kinematics import forward_and_jacobian, pose_error
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.chain_columns import column_chain, rotation_vectors
from duocell.models.kinematics.kinematics import flange_poses


@pytest.mark.parametrize("name", ["iiwa14", "jaco2", "yumi_left", "puma560"])
def test_frames_and_jacobians_are_those_of_the_robot(name: str) -> None:
    arm = robot(name)
    q = np.random.default_rng(3).uniform(-2.0, 2.0, (11, arm.dof))
    columns, position, jacobian = column_chain(arm).forward_and_jacobian(q.T)
    poses = flange_poses(arm, q)
    assert np.allclose(columns.transpose(2, 1, 0), poses[:, :3, :3], atol=1e-12)
    assert np.allclose(position.T, poses[:, :3, 3], atol=1e-12)
    assert np.allclose(jacobian.transpose(2, 1, 0), forward_and_jacobian(chain_of(arm), q)[2], atol=1e-12)
    again = column_chain(arm).forward(q.T)
    assert np.array_equal(again[0], columns)
    assert np.array_equal(again[1], position)


def test_rotation_vectors_are_those_of_the_pose_error() -> None:
    q = np.random.default_rng(4).uniform(-2.0, 2.0, (9, 7))
    poses = flange_poses(robot("iiwa14"), q)
    target = poses[0]
    vectors = rotation_vectors(poses[:, :3, :3].transpose(2, 1, 0), np.repeat(target[:3, :3].T[:, :, None], 9, axis=2))
    assert np.allclose(vectors.T, pose_error(poses[:, :3, :3], poses[:, :3, 3], target)[:, 3:], atol=1e-9)
