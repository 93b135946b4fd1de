"""Reasons made of numbers that are known: which poses and joints they name, in which order, by how much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.models.robot.arm import Arm
from duocell.models.robot.linear_limits import LinearLimits
from duocell.optimizer.reasons.reasons import explain_general, explain_path, explain_proof, explain_reach, name_segments
from duocell.optimizer.reduction.layers import LayeredPath
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.results.proof import InfeasibilityCause
from tests.support.given.arms import make_arm, region

COUNT = 12
LIMIT = 1.0


def limited(linear_limits: LinearLimits | None = None) -> Arm:
    """An arm all of whose joints may turn by 1 rad to either side; its wrist may be singular."""
    side = np.full(6, LIMIT)
    return make_arm(
        "ur5e",
        "main",
        lower=-side,
        upper=side,
        reference=np.zeros(6),
        avoid_singularities=False,
        linear_limits=linear_limits,
    )


def cell_of(arm: Arm, count: int = COUNT) -> Cell:
    return Cell(Task(np.tile(np.eye(4), (count, 1, 1))), (arm,), max_joint_step=0.5)


def test_joints_beyond_their_limits_are_named_the_worst_first() -> None:
    arm = limited()
    joints = np.zeros((COUNT, 6))
    joints[:, 1] = np.linspace(0.0, LIMIT + 0.1, COUNT)  # only the last pose is beyond
    joints[:, 4] = -np.linspace(LIMIT - 0.1, LIMIT + 0.2, COUNT)
    worst, other = explain_path(cell_of(arm), arm, joints, np.zeros(COUNT))
    assert (worst.joint, other.joint) == (arm.robot.joint_names[4], arm.robot.joint_names[1])
    assert (worst.kind, worst.arm, worst.unit) == ("joint_limit", "main", "rad")
    assert worst.amount == pytest.approx(0.2)
    assert other.amount == pytest.approx(0.1)
    assert worst.poses == tuple(range(4, 12))
    assert other.poses == (11,)
    assert "11.46° at poses 4 to 11" in worst.detail
    assert "5.73° at pose 11" in other.detail
    assert explain_path(cell_of(arm), arm, np.clip(joints, -LIMIT, LIMIT), np.zeros(COUNT)) == ()


def test_a_sum_of_joints_is_named_by_its_own_name() -> None:
    sums = LinearLimits(("both",), np.array([[0.0, 1.0, 1.0, 0.0, 0.0, 0.0]]), np.array([-0.5]), np.array([0.5]))
    arm = limited(linear_limits=sums)
    joints = np.zeros((COUNT, 6))
    joints[3:5, 1:3] = 0.4
    (reason,) = explain_path(cell_of(arm), arm, joints, np.zeros(COUNT))
    assert (reason.kind, reason.joint, reason.poses) == ("joint_limit", "both", (3, 4))
    assert reason.amount == pytest.approx(0.3)


def test_long_steps_are_told_at_the_pose_they_lead_to_but_not_from_segment_to_segment() -> None:
    arm = limited()
    joints = np.zeros((COUNT, 6))
    joints[5:, 0], joints[8:, 3] = 0.7, 0.9
    found = explain_path(cell_of(arm), arm, joints, np.zeros(COUNT))
    assert [reason.kind for reason in found] == ["joint_step", "joint_step"]
    assert [reason.joint for reason in found] == [arm.robot.joint_names[3], arm.robot.joint_names[0]]
    assert [reason.poses for reason in found] == [(8,), (5,)]
    assert [reason.amount for reason in found] == pytest.approx([0.4, 0.2])
    apart = replace(cell_of(arm), task=Task(np.tile(np.eye(4), (COUNT, 1, 1)), starts=(0, 5, 8)))
    assert explain_path(apart, arm, joints, np.zeros(COUNT)) == ()


def test_what_reach_lacks_comes_first_and_poses_count_from_the_first_of_the_cell() -> None:
    arm = limited()
    joints, missing = np.zeros((COUNT, 6)), np.zeros(COUNT)
    missing[[0, 1, 4]] = 0.1, 0.3, 0.2
    joints[2:, 5] = LIMIT + 0.1
    far, beyond, step = explain_path(cell_of(arm), arm, joints, missing, "from here", first=20)
    assert (far.kind, far.poses, far.amount, far.unit) == ("out_of_reach", (20, 21, 24), 0.3, "m")
    assert far.detail == "main: from here poses 20, 21, 24 out of reach by up to 0.300 m"
    assert beyond.poses == tuple(range(22, 32))
    assert step.poses == (22,)


def test_many_scattered_poses_are_shortened() -> None:
    arm = limited()
    missing = np.where(np.arange(30) % 3 == 0, 1.0, 0.0)
    (reason,) = explain_path(cell_of(arm, 30), arm, np.zeros((30, 6)), missing)
    assert len(reason.poses) == 10
    assert "poses 0, 3, 6, 9, 12, 15, 18, 21 and 2 more out of reach" in reason.detail


def test_the_nearest_of_the_paths_is_explained_and_without_any_what_was_not_reached() -> None:
    arm = limited()
    good, bad = np.zeros((COUNT, 6)), np.zeros((COUNT, 6))
    good[:, 2], bad[:, 3] = LIMIT + 0.1, LIMIT + 0.5
    nothing = LayeredPath(np.zeros(3), 0.0, np.zeros((0, 6)), 0.0, 0.0)
    paths = [LayeredPath(np.zeros(3), 0.0, joints, 0.0, far) for joints, far in ((bad, 0.5), (good, 0.1))]
    (reason,) = explain_general(cell_of(arm), arm, [nothing, *paths])
    assert reason.joint == arm.robot.joint_names[2]
    (free,) = explain_general(cell_of(arm), arm, [replace(paths[0], joints=np.zeros((COUNT, 6)))])
    assert (free.kind, free.poses) == ("posture", ())
    (all_of_them,) = explain_general(cell_of(arm), arm, [nothing])
    assert (all_of_them.kind, all_of_them.poses) == ("out_of_reach", tuple(range(COUNT)))
    (some,) = explain_general(cell_of(arm), arm, [], (2, 7))
    assert some.poses == (2, 7)
    assert "reaches poses 2, 7 from" in some.detail


def test_a_proof_tells_its_three_largest_causes() -> None:
    sums = LinearLimits(("both",), np.array([[0.0, 1.0, 1.0, 0.0, 0.0, 0.0]]), np.array([-0.5]), np.array([0.5]))
    arm = limited(linear_limits=sums)
    shares = np.array([0.0, 0.1, 0.4, 0.2])
    causes = (
        InfeasibilityCause("joint_limit", 2, 0.7, shares),
        InfeasibilityCause("linear_limit", None, 0.5, np.array([1.0, 0.0, 0.0, 0.0])),
        InfeasibilityCause("out_of_reach", None, 0.251, np.zeros(4)),
        InfeasibilityCause("joint_step", 1, 0.1, shares),
    )
    first, second, third = explain_proof(cell_of(arm, 4), arm, causes)
    assert (first.kind, first.joint, first.poses) == ("joint_limit", arm.robot.joint_names[2], (2, 3))
    assert f"poses 2, 3 need {arm.robot.joint_names[2]} beyond its limits in 70 % of" in first.detail
    assert (second.kind, second.joint, second.poses) == ("joint_limit", "both", (0,))
    assert "pose 0 need both beyond its limits in 50 % of" in second.detail
    assert (third.kind, third.joint, third.poses) == ("out_of_reach", None, ())
    assert "are out of reach in 25 % of" in third.detail


@pytest.mark.parametrize(
    ("poses", "suffix"), [((0, 1), "[job a]"), ((1, 2), "[jobs a, 1]"), ((4,), "[job c]"), ((), "")]
)
def test_the_segments_of_the_poses_are_named(poses: tuple[int, ...], suffix: str) -> None:
    two = Task(np.tile(np.eye(4), (2, 1, 1)))
    task = task_sequence([TaskSegment(name, two) for name in ("a", "", "c")])
    reason = Reason("main", "joint_limit", poses, "main: so it is")
    (named,) = name_segments(task, (reason,))
    assert named == replace(reason, detail=f"main: so it is {suffix}".rstrip())
    assert name_segments(two, (reason,)) == (reason,)


def test_of_two_poses_too_far_apart_the_axis_and_what_is_missing_are_told() -> None:
    """Both ways round; a metre farther apart, a metre more is missing."""
    arm = make_arm("ur5e", "main", base=region((-20, 20), (-20, 20), (-20, 20)))
    missing = []
    for side in (3.0, 3.5):
        poses = np.tile(np.eye(4), (3, 1, 1))
        poses[[0, 2], 1, 3] = side, -side
        (reason,) = explain_reach(Cell(Task(poses), (arm,)), arm, first=10)
        assert (reason.kind, reason.poses, reason.unit) == ("out_of_reach", (10, 12), "m")
        assert "along y at least" in reason.detail
        assert reason.amount is not None
        missing.append(reason.amount)
    assert 2.0 * 3.5 - 2.0 * 1.6 < missing[1] < 2.0 * 3.5  # a UR5e reaches a good metre to either side
    assert missing[1] - missing[0] == pytest.approx(1.0)
