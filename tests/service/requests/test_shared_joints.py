"""Two arms of one machine with a joint in common are no two arms."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import pytest

from duocell.models.description.urdf import robot_from_urdf
from duocell.models.robot.robot import Robot
from duocell.service.common.issues import IssueCollector
from duocell.service.requests.shared_joints import check_shared_joints
from tests.support.given.acceptance import FOLDER
from tests.support.given.arms import make_arm

FILE = FOLDER / "urdf" / "15_two_arms_on_one_torso_joint.urdf"


def robot(base: str | None, tip: str) -> Robot:
    return replace(robot_from_urdf(FILE, base, tip), description=hashlib.sha256(FILE.read_bytes()).hexdigest())


@pytest.mark.parametrize(
    ("first", "second", "refused"),
    [
        (("pillar", "left_tool0"), ("pillar", "right_tool0"), True),
        (("pillar", "left_tool0"), ("torso", "right_tool0"), False),
        (("torso", "left_tool0"), ("torso", "right_tool0"), False),
        (("pillar", "left_tool0"), ("pillar", "left_tool0"), False),  # two machines of one kind
    ],
)
def test_a_torso_joint_belongs_to_one_arm(first: tuple[str, str], second: tuple[str, str], refused: bool) -> None:
    issues = IssueCollector()
    check_shared_joints([make_arm(robot(*first), "left"), None, make_arm(robot(*second), "right")], issues)
    assert [issue.pointer for issue in issues.found] == (["/arms/2/robot"] if refused else [])
    assert all("torso_j" in issue.detail for issue in issues.found)
