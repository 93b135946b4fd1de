"""The geometry that rounded and calibrated arms were drawn as, and how far it is from theirs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.pose import rotation_about, rotation_angle, transform
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.reference import working_reference
from duocell.models.description.urdf import robot_from_urdf
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.inverse import branches, source_of_branches
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.kinematics.nominal import as_drawn, nominal, posture_form
from duocell.models.robot.robot import Robot
from tests.support.given.acceptance import FOLDER
from tests.support.given.arms import general_six, random_joints


def calibrated(name: str, angle: float, length: float, seed: int = 0) -> Robot:
    """An arm of the catalogue whose joints stand where a calibration finds them."""
    robot, rng = catalogue.robot(name), np.random.default_rng(seed)
    placements = robot.joint_placements.copy()
    for i in range(robot.dof):
        axis = rng.normal(size=3)
        turn = rotation_about(axis / np.linalg.norm(axis), angle * rng.uniform(0.3, 1.0))
        placements[i] = placements[i] @ transform(turn, length * rng.uniform(-1.0, 1.0, 3))
    return replace(robot, name=f"calibrated {name}", joint_placements=placements, ssik_name=None)


ARMS = [
    ("ur10e", 1e-3, 2e-4),
    ("ur5e", 2e-4, 1e-5),
    ("irb120", 1e-3, 2e-4),
    ("puma560", 5e-4, 1e-4),
    ("kr6_r900", 1e-6, 1e-6),
]


@pytest.mark.parametrize(("name", "angle", "length"), [arm for arm in ARMS if arm[0] in catalogue.names()])
def test_a_calibrated_arm_has_the_closed_form_of_its_drawing_within_stated_bounds(
    name: str, angle: float, length: float
) -> None:
    robot = calibrated(name, angle, length)
    assert closed_form(robot) is None or chain_of(robot).vertical_sign == 0
    meant = nominal(robot)
    assert meant is not None
    form, drawn = closed_form(meant.robot), closed_form(catalogue.robot(name))
    assert form is not None
    assert drawn is not None
    assert form.kind == drawn.kind
    assert chain_of(meant.robot).vertical_sign == chain_of(catalogue.robot(name)).vertical_sign
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (300, 6))
    true, nearly = flange_poses(robot, q), flange_poses(meant.robot, q)
    away = np.linalg.norm(true[:, :3, 3] - nearly[:, :3, 3], axis=1).max()
    turned = rotation_angle(np.swapaxes(true[:, :3, :3], 1, 2) @ nearly[:, :3, :3]).max()
    assert 0.0 < away <= meant.position < 50.0 * (length + 2.0 * angle)
    assert 0.0 < turned <= meant.angle < 30.0 * angle
    frames, drawn_frames = link_frames(robot, q), link_frames(meant.robot, q)  # bodies are given in them
    assert np.abs(frames - drawn_frames).max() < meant.position + meant.angle


@pytest.mark.parametrize("name", ["ur10e", "puma560"])
def test_an_arm_that_is_as_drawn_needs_no_other(name: str) -> None:
    robot = catalogue.robot(name)
    assert nominal(robot) is None
    assert posture_form(robot) is closed_form(robot)


def test_digits_that_a_file_leaves_out_are_put_back() -> None:
    file = FOLDER / "urdf" / "17_puma_nine_digit_angles_called_infeasible.urdf"
    robot = robot_from_urdf(file)
    meant = nominal(robot)
    assert meant is not None
    assert meant.negligible
    assert 1e-9 < max(meant.position, meant.angle) < 1e-7
    axes = chain_of(meant.robot).axes
    assert np.abs(axes - np.round(axes)).max() < 1e-14
    assert posture_form(robot) is closed_form(robot)


def test_an_arm_of_no_class_stays_one() -> None:
    assert nominal(general_six()) is None
    assert posture_form(general_six()) is None


def test_branches_are_those_of_the_drawing_refined_on_the_true_arm() -> None:
    robot = calibrated("ur10e", 1e-3, 2e-4)
    q = random_joints(robot, 5, np.random.default_rng(3))
    targets = flange_poses(robot, q)
    for row, target, found in zip(q, targets, branches(robot, targets), strict=True):
        assert np.abs(flange_poses(robot, found) - target).max() < 1e-9
        away = np.abs(np.arctan2(np.sin(found - row), np.cos(found - row))).max(axis=1)
        assert away.min() < 1e-6
    assert "refined" in source_of_branches(robot)


def test_an_angle_printed_as_1_571_does_not_turn_the_reference_over() -> None:
    file = FOLDER / "urdf" / "02_camera_frame_taken_as_flange.urdf"
    robot = robot_from_urdf(file)
    placements = robot.joint_placements.copy()
    for i, axis in ((1, [-1.0, 0.0, 0.0]), (3, [0.0, 1.0, 0.0]), (4, [0.0, -1.0, 0.0]), (5, [0.0, 1.0, 0.0])):
        placements[i, :3, :3] = rotation_about(np.array(axis), 1.571)
    rounded = replace(robot, joint_placements=placements)
    assert working_reference(as_drawn(rounded))[0] == pytest.approx(working_reference(robot)[0], abs=1e-9)
