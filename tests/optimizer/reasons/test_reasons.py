"""Impossible tasks: which arm, which poses, which joint, why, by how much; and no proof where there is none."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.kinematics import flange_poses, reach
from duocell.models.robot.posture import Posture
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout, Reason
from tests.support.given.arms import make_arm, only_at, region
from tests.support.given.fields import PossibleFields
from tests.support.given.tasks import Possible, possible, with_arm
from tests.support.given.witness import posture_of_witness
from tests.support.present import present

KINDS = {"out_of_reach", "joint_limit", "joint_step", "posture", "conditioning", "limit_reached"}


def why(cell: Cell) -> tuple[Layout, tuple[Reason, ...]]:
    """The layout of a cell that is impossible, and the reasons of its arms, which are well formed."""
    layout = optimize(cell)
    assert not layout.usable
    assert layout.objective is None
    stopped = [reason.kind for reason in layout.reasons if not reason.arm]
    assert stopped == ([] if layout.proved else ["not_found"])
    reasons = tuple(reason for reason in layout.reasons if reason.arm)
    assert reasons
    names = {arm.name: arm.robot.joint_names for arm in cell.arms}
    for reason in reasons:
        assert reason.kind in KINDS
        assert reason.arm in names
        assert reason.detail.startswith(reason.arm)
        assert all(0 <= j < len(cell.task) for j in reason.poses)
        assert list(reason.poses) == sorted(set(reason.poses))
        assert reason.joint is None or reason.joint in names[reason.arm]
        without_unit = reason.amount is None or reason.kind == "conditioning"
        assert (reason.unit == "") == without_unit
        assert reason.amount is None or reason.amount > 0.0
    return layout, reasons


def standing(name: str, seed: int = 0, **given: Unpack[PossibleFields]) -> Possible:
    """A possible task whose base is fixed where the witness stands."""
    task = possible(name, np.random.default_rng(seed), **given)
    arm = replace(task.arm, base=only_at(task.position, task.yaw))
    return replace(task, cell=replace(task.cell, arms=(arm,)))


@pytest.mark.parametrize("name", ["puma560", "ur10e", "iiwa14", "fanuc_crx10ia", "yumi_left"])
def test_a_region_far_away_is_out_of_reach_for_certain(name: str) -> None:
    task = standing(name)
    layout, (reason,) = why(with_arm(task, base=region((10, 11), (10, 11))))
    assert layout.proved
    assert reason.kind == "out_of_reach"
    assert reason.poses == tuple(range(len(task.cell.task)))
    gap = np.linalg.norm(task.cell.flange_targets(task.arm)[:, :2, 3] - [10.0, 10.0], axis=1).max()
    assert 0.0 < present(reason.amount) <= gap  # at least so much is missing
    assert reason.unit == "m"


@pytest.mark.parametrize("name", ["puma560", "iiwa14"])
def test_only_the_poses_that_are_far_away_are_named(name: str) -> None:
    task = standing(name, poses=6)
    poses = task.cell.task.poses.copy()
    poses[[2, 5], 1, 3] += 9.0
    layout, (reason,) = why(replace(task.cell, task=Task(poses)))
    assert layout.proved
    assert (reason.kind, reason.poses) == ("out_of_reach", (2, 5))


def test_two_poses_too_far_apart_for_any_base_are_both_named() -> None:
    task = possible("ur5e", np.random.default_rng(1), poses=5)
    poses = task.cell.task.poses.copy()
    poses[1, 0, 3] -= 3.0
    poses[3, 0, 3] += 3.0
    layout, (reason,) = why(
        replace(task.cell, task=Task(poses), arms=(replace(task.arm, base=region((-20, 20), (-20, 20), (-5, 5))),))
    )
    assert layout.proved
    assert (reason.kind, reason.poses) == ("out_of_reach", (1, 3))


@pytest.mark.parametrize("name", ["puma560", "ur5e", "iiwa14"])
def test_a_pose_beyond_the_arm_but_inside_the_simple_bound_is_out_of_reach(name: str) -> None:
    """The bound of the windows does not see it; the search does, and names the pose."""
    arm = make_arm(name, base=region(0, 0, 0, 0))
    inside = flange_poses(arm.robot, arm.reference)[0]
    far = inside.copy()
    far[:3, 3] = np.array([0.0, 0.0, -0.985 * reach(arm.robot)])  # straight down, where the base's height costs
    layout, reasons = why(Cell(Task(np.array([inside, inside, far])), (arm,)))
    assert "out_of_reach" in {reason.kind for reason in reasons}
    assert all(reason.poses == (2,) for reason in reasons if reason.kind == "out_of_reach")
    assert layout.placements == ()


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900"])
def test_a_joint_limit_alone_is_named_with_its_poses(name: str) -> None:
    """The base is fixed, the posture too; one joint may not go where the last poses need it."""
    for seed in range(12):
        task = standing(name, seed, poses=6, step=0.1)
        span = np.diff(task.joints, axis=0)
        steady = [i for i in range(1, 6) if np.all(span[:, i] > 0.02)]
        if steady:
            break
    joint = steady[0]
    upper = task.arm.upper.copy()
    upper[joint] = 0.5 * (task.joints[3, joint] + task.joints[4, joint])
    lower = np.maximum(task.arm.lower, task.joints.min(axis=0) - 1.0)  # no other turn fits
    _, reasons = why(
        with_arm(
            task,
            upper=upper,
            lower=lower,
            posture=posture_of_witness(task),
            reference=np.clip(task.arm.reference, lower, upper),
        )
    )
    limited = [reason for reason in reasons if reason.kind == "joint_limit"]
    assert limited == list(reasons)
    assert {j for reason in limited for j in reason.poses} == {4, 5}
    excess = task.joints[5, joint] - upper[joint]
    for reason in limited:
        if reason.amount is not None:
            assert reason.unit == "rad"
            assert reason.amount == pytest.approx(excess, abs=1e-6)
    assert all(reason.joint in (None, task.arm.robot.joint_names[joint]) for reason in limited)


@pytest.mark.parametrize("name", ["puma560", "ur10e"])
def test_a_posture_that_the_limits_rule_out_is_told(name: str) -> None:
    """Joint 5 may only be on one side of its singularity, and the other side is asked for."""
    task = standing(name, 3)
    signs = posture_of_witness(task)
    asked = replace(signs, wrist=1 if signs.wrist == -1 else -1)
    low = np.maximum(task.arm.lower, task.joints.min(axis=0) - 0.1)
    high = np.minimum(task.arm.upper, task.joints.max(axis=0) + 0.1)
    _, reasons = why(with_arm(task, posture=asked, lower=low, upper=high, reference=0.5 * (low + high)))
    assert {reason.kind for reason in reasons} <= {"joint_limit", "posture"}
    assert {j for reason in reasons for j in reason.poses} in (set(), set(range(len(task.cell.task))))
    assert any("posture" in reason.detail or reason.joint for reason in reasons)
    assert optimize(with_arm(task, posture=signs, lower=low, upper=high)).usable


def test_a_path_through_a_wrist_singularity_jumps_where_it_is_said_to() -> None:
    """θ5 passes zero between poses 2 and 3: in one posture θ4 and θ6 turn by half a turn there."""
    puma = make_arm("puma560", base=region(0, 0, 0, 0), posture=Posture(1, -1, 1))
    turning = np.array([0, 0, 0, 1, 0, 1])
    arm = replace(puma, lower=puma.lower - 7.0 * turning, upper=puma.upper + 7.0 * turning)
    q = np.array([0.2, -0.8, 2.4, 0.4, 0.0, 0.1])
    joints = np.array([q + np.array([0, 0, 0, 0, bend, 0]) for bend in (0.3, 0.2, 0.1, -0.1, -0.2)])
    task = Task(transform(np.eye(3), np.zeros(3)) @ flange_poses(arm.robot, joints))
    layout, reasons = why(Cell(task, (arm,)))
    assert {reason.kind for reason in reasons} == {"joint_step"}
    assert {j for reason in reasons for j in reason.poses} in ({3}, {2, 3})
    names = arm.robot.joint_names
    assert {reason.joint for reason in reasons} == {names[3], names[5]}
    for reason in reasons:
        if reason.amount is not None:
            assert reason.amount == pytest.approx(np.pi / 2.0, abs=0.1)  # half a turn, a quarter is allowed
    (nearest,) = layout.placements
    turned = np.abs(np.diff(nearest.joints, axis=0)[2])
    assert turned[[3, 5]] == pytest.approx(np.pi, abs=0.1)
    assert layout.verification is not None
    assert layout.verification.max_joint_step == pytest.approx(np.max(turned), abs=1e-9)
    assert layout.verification.max_position_error < 1e-6


def test_the_arm_that_fails_is_named_and_the_other_is_placed() -> None:
    task = possible("puma560", np.random.default_rng(5))
    good = replace(task.arm, name="good")
    bad = replace(task.arm, name="bad", base=region((30, 31), (30, 31)))
    for arms in ((good, bad), (bad, good)):
        layout, reasons = why(replace(task.cell, arms=arms))
        assert {reason.arm for reason in reasons} == {"bad"}
        assert [p.arm for p in layout.placements] == ["good"]
        assert layout.proved
        assert layout.verification is not None
        assert layout.verification.max_position_error < 1e-6


@pytest.mark.parametrize("name", ["iiwa14", "fanuc_crx10ia", "ur5e"])
def test_an_impossible_joint_step_has_a_reason(name: str) -> None:
    """Two poses half a metre apart with joints that may hardly move."""
    task = standing(name, 6, poses=2, step=0.5)
    _, reasons = why(replace(task.cell, max_joint_step=0.01))
    assert {reason.kind for reason in reasons} <= {"joint_step", "posture"}
    assert {j for reason in reasons for j in reason.poses} in ({1}, {0, 1}, set())


def test_conditioning_that_no_base_offers_is_a_reason() -> None:
    task = standing("puma560", 7)
    layout, reasons = why(with_arm(task, min_conditioning=0.99))
    assert layout.proved
    assert {reason.kind for reason in reasons} <= {"conditioning", "posture", "joint_limit"}  # each excludes some boxes
    assert any("conditioning" in reason.detail for reason in reasons)


def test_sentences_name_poses_so_that_a_person_can_find_them() -> None:
    task = standing("puma560", poses=6)
    poses = task.cell.task.poses.copy()
    poses[4, 1, 3] += 9.0
    _, (reason,) = why(replace(task.cell, task=Task(poses)))
    assert "pose 4 " in reason.detail


@pytest.mark.parametrize(("x", "words"), [(4.0, "a longer robot"), (40.0, "every length is in metres")])
def test_nobody_is_told_to_take_a_robot_that_is_metres_longer(x: float, words: str) -> None:
    task = standing("ur5e")
    (reason,) = why(with_arm(task, base=region((x, x + 1.0), (0.0, 1.0), (0.0, 0.1))))[1]
    assert reason.kind == "out_of_reach"
    assert words in reason.detail
