"""Robots of the command line tell what else their file could mean."""

from __future__ import annotations

import pytest

from duocell.service.uploads.urdf_on_disk import robot_on_disk
from tests.support.given.acceptance import FOLDER


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("15_two_arms_on_one_torso_joint.urdf", "right_base_link:right_tool0 (another arm of the file)"),
        ("01_gripper_finger_taken_as_joint7.urdf", "base_link:finger_1_link (its last joint was taken for a tool's)"),
        ("02_camera_frame_taken_as_flange.urdf", ""),
    ],
)
def test_another_arm_that_could_be_meant_is_told(file: str, words: str) -> None:
    told: list[str] = []
    robot = robot_on_disk("arm", FOLDER / "urdf" / file, None, None, told.append)
    assert robot.chain is not None
    assert [words in sentence for sentence in told] == ([True] if words else [])
