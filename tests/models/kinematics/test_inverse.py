"""Every branch of a pose behind one interface, whatever the arm."""

from __future__ import annotations

import numpy as np
import pytest
import ssik

from duocell.models.catalogue import catalogue
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.inverse import branches, posture_definitions, source_of_branches
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.numeric_inverse import numeric_branches
from tests.support.angles import same_set, wrapped
from tests.support.given.arms import general_six, oblique_wrist, puma_by_table, random_joints
from tests.support.given.classes import OTHERS


@pytest.mark.parametrize("name", OTHERS)
def test_branches_of_other_arms_close_and_are_those_of_ssik(name: str) -> None:
    robot = catalogue.robot(name)
    poses = flange_poses(robot, random_joints(robot, 4, np.random.default_rng(6)))
    assert robot.ssik_name is not None
    theirs = ssik.Manipulator.from_prebuilt(robot.ssik_name)
    for pose, found in zip(poses, branches(robot, poses), strict=True):
        assert len(found) > 0
        assert found.shape[1] == robot.dof
        assert np.abs(flange_poses(robot, found) - pose).max() < 1e-6  # ssik's own tolerance is 1e-5
        if robot.dof == 6:
            expected = np.array([s.q for s in theirs.solve(pose, respect_limits=False)])
            assert same_set(found, expected, 1e-6)


@pytest.mark.parametrize("name", [name for name in OTHERS if catalogue.robot(name).dof == 6])
def test_six_joint_arms_find_the_joints_they_were_posed_with(name: str) -> None:
    robot = catalogue.robot(name)
    joints = random_joints(robot, 6, np.random.default_rng(8))
    for own, found in zip(joints, branches(robot, flange_poses(robot, joints)), strict=True):
        assert np.abs(wrapped(found - own)).max(axis=1).min() < 1e-5


@pytest.mark.parametrize("name", ["puma560", "iiwa14", "fanuc_crx10ia", "ur5e"])
def test_a_pose_out_of_reach_has_no_branch(name: str) -> None:
    pose = np.eye(4)
    pose[:3, 3] = 50.0
    (found,) = branches(catalogue.robot(name), pose[None])
    assert found.shape == (0, catalogue.robot(name).dof)


def test_an_arm_sent_as_a_table_uses_its_closed_form() -> None:
    table, named = puma_by_table(), catalogue.robot("puma560")
    poses = flange_poses(named, random_joints(named, 5, np.random.default_rng(1)))
    for ours, theirs in zip(branches(table, poses), branches(named, poses), strict=True):
        assert np.allclose(ours, theirs, rtol=0.0, atol=1e-12)


def test_a_general_arm_sent_as_a_table_finds_the_joints_it_was_posed_with() -> None:
    robot = general_six()
    assert closed_form(robot) is None
    joints = random_joints(robot, 10, np.random.default_rng(2))
    for own, found in zip(joints, branches(robot, flange_poses(robot, joints)), strict=True):
        assert np.abs(wrapped(found - own)).max(axis=1).min() < 1e-6


def test_an_oblique_wrist_has_no_branch_for_orientations_outside_its_cone() -> None:
    """Its axes are 60° apart: the tool axis cannot leave a cone of 120° about the forearm."""
    robot = oblique_wrist()
    poses = flange_poses(robot, np.random.default_rng(4).uniform(-2.5, 2.5, (40, 6)))
    poses[:, :3, :3] = np.roll(poses[:, :3, :3], 1, axis=0)  # orientations of other poses
    counts = []
    for pose, found in zip(poses, branches(robot, poses), strict=True):
        if len(found):
            assert np.abs(flange_poses(robot, found) - pose).max() < 1e-8
        numeric = numeric_branches(robot, pose)
        for solution in numeric:
            assert np.abs(wrapped(found - solution)).max(axis=1).min() < 1e-5
        counts.append(len(found))
    assert min(counts) < 8


def test_the_source_of_branches_is_told() -> None:
    assert "spherical wrist" in source_of_branches(catalogue.robot("puma560"))
    assert "three parallel" in source_of_branches(catalogue.robot("ur5e"))
    assert "redundancy" in source_of_branches(catalogue.robot("iiwa14"))
    assert source_of_branches(catalogue.robot("fanuc_crx10ia")) == "analytic (ssik)"
    assert "numeric" in source_of_branches(general_six())


def test_postures_are_defined_exactly_for_the_arms_that_have_them() -> None:
    for name in ("puma560", "ur10e", "kr6_r900", "irb120"):
        words = posture_definitions(catalogue.robot(name))
        assert words is not None
        assert {key: set(value) for key, value in words.items()} == {
            "shoulder": {"left", "right"},
            "elbow": {"up", "down"},
            "wrist": {"flip", "noflip"},
        }
        assert all(text for pair in words.values() for text in pair.values())
    for name in ("iiwa14", "fanuc_crx10ia", "gen3"):
        assert posture_definitions(catalogue.robot(name)) is None
