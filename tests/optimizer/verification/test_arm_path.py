"""A way is followed as a dense continuation of one branch follows it; where it cannot be, the place is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_about, rotation_vector, transform
from duocell.models.catalogue import catalogue
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import posture_of, signs_of, solve_signed
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Arm
from duocell.models.robot.linear_limits import LinearLimits
from duocell.optimizer.clearance.path_samples import ObjectPath, follow, keep_inside
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.words import arm_path_faults
from tests.support.given.arms import form_of, make_arm
from tests.support.given.tasks import Possible, possible
from tests.support.given.witness import witness_of


def dense(task: Possible, point: ArmSolution, count: int) -> tuple[bool, float]:
    """Whether joints continued in small steps arrive at the next pose, and the largest excess over limits on the way.

    Newton's method from the sample before; no halving, no bounds, no closed form.
    """
    arm = task.arm
    path, base = ObjectPath(task.cell.task.poses), arm.base_in_world(point.position, point.yaw)
    beyond, q = -np.inf, point.joints[0]
    for fraction in np.arange(1, count + 1) / count:
        flange = path.at(np.zeros(1, dtype=int), np.array([fraction])) @ arm.grasp @ inverse(arm.tool)
        (new,), arrived = follow(arm.robot, base, flange, q[None], q[None])
        if not arrived[0]:
            return False, beyond
        q = new
        beyond = max(beyond, float(np.max(np.maximum(arm.lower - q, q - arm.upper))))
    return bool(np.max(np.abs(q - point.joints[1])) < 1e-6), beyond


def given(name: str, seed: int, step: float) -> tuple[Possible, ArmSolution]:
    """Two postures at a random distance; some of the ways between them leave reach or pass singularities."""
    task = possible(name, np.random.default_rng(seed), poses=2, step=0.1)
    rng = np.random.default_rng([seed, 1])
    joints, form = task.joints.copy(), form_of(task.arm.robot)
    signs = posture_of(form, joints[0])
    while True:
        away = joints[0] + rng.uniform(-step, step, task.arm.dof)
        joints[1] = np.clip(away, task.arm.lower, task.arm.upper)
        if tuple(signs_of(form, joints[1])) == signs:
            break
    flange = task.arm.base_in_world(task.position, task.yaw) @ flange_poses(task.arm.robot, joints)
    poses = Task(flange @ task.arm.tool @ inverse(task.arm.grasp))
    return replace(task, cell=replace(task.cell, task=poses)), ArmSolution(task.position, task.yaw, joints, signs)


@pytest.mark.parametrize("name", ["puma560", "ur10e"])
def test_breaks_are_those_of_a_dense_continuation(name: str) -> None:
    found = []
    for seed in range(8):
        task, point = given(name, seed, step=2.0)
        checked = check_arm_path(task.cell, task.arm, point)
        arrives, beyond = dense(task, point, count=60)
        if not arrives:  # near a singularity steps have to be small
            arrives, beyond = dense(task, point, count=1500)
        found.append((not checked.breaks, arrives))
        if arrives and not checked.breaks:
            assert bool(checked.excesses) or beyond <= 1e-4
            assert max((one.amount for one in checked.excesses), default=0.0) <= max(beyond, 0.0) + 1e-4
    assert [ours for ours, _ in found] == [theirs for _, theirs in found]
    assert 1 <= sum(arrives for _, arrives in found) <= 7


def broken() -> tuple[Possible, ArmSolution]:
    for seed in range(40):
        task, point = given("ur10e", seed, step=2.0)
        if check_arm_path(task.cell, task.arm, point).breaks:
            return task, point
    raise AssertionError("no way breaks")


def test_a_break_is_told_with_the_poses_between_which_one_is_missing() -> None:
    task, point = broken()
    (reason,) = arm_path_faults(check_arm_path(task.cell, task.arm, point).breaks, ())
    assert (reason.kind, reason.poses) == ("joint_step", (0, 1))
    assert "add a pose between 0 and 1" in reason.detail


def test_from_segment_to_segment_there_is_no_way() -> None:
    task, point = broken()
    assert check_arm_path(replace(task.cell, task=Task(task.cell.task.poses, starts=(0, 1))), task.arm, point).free


def test_a_redundant_arm_is_followed_by_newtons_method() -> None:
    task = possible("iiwa14", np.random.default_rng(4), poses=4, step=0.1)
    assert check_arm_path(task.cell, task.arm, witness_of(task)).free


def half_way() -> tuple[Possible, Floats, Floats, Floats]:
    """A redundant arm with two poses: its base, and flange and joints half way."""
    task = possible("iiwa14", np.random.default_rng(4), poses=2, step=0.5)
    path, base = ObjectPath(task.cell.task.poses), task.arm.base_in_world(task.position, task.yaw)
    flange = path.at(np.zeros(1, dtype=int), np.array([0.5])) @ task.arm.grasp @ inverse(task.arm.tool)
    (middle,), _ = follow(task.arm.robot, base, flange, task.joints[:1], task.joints[1:])
    return task, base, flange, middle


def test_a_redundant_arm_gives_way_to_a_limit_between_its_poses() -> None:
    task, base, flange, middle = half_way()
    over = middle - np.max(task.joints, axis=0)
    joint = int(np.argmax(over))
    assert over[joint] > 1e-3
    upper = task.arm.upper.copy()
    upper[joint] = middle[joint] - 0.5 * over[joint]
    arm = replace(task.arm, upper=upper)
    assert check_arm_path(replace(task.cell, arms=(arm,)), arm, witness_of(task)).free
    (inside,), arrived = keep_inside(arm, base, flange, middle[None])
    assert arrived[0]
    assert inside[joint] == upper[joint]
    np.testing.assert_allclose(base @ flange_poses(arm.robot, inside[None])[0], flange[0], atol=1e-7)


def test_a_redundant_arm_gives_way_to_a_linear_limit_between_its_poses() -> None:
    task, base, flange, middle = half_way()
    row = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    ends, over = float(np.max(task.joints @ row)), float(middle @ row)
    assert over - ends > 5e-2
    limits = LinearLimits(("sum",), row[None], np.array([over - 4.0]), np.array([over - 0.5 * (over - ends)]))
    arm = replace(task.arm, linear_limits=limits)
    assert check_arm_path(replace(task.cell, arms=(arm,)), arm, witness_of(task)).free
    (inside,), arrived = keep_inside(arm, base, flange, middle[None])
    assert arrived[0]
    assert float(inside @ row) == pytest.approx(float(limits.upper[0]), abs=1e-8)
    np.testing.assert_allclose(base @ flange_poses(arm.robot, inside[None])[0], flange[0], atol=1e-7)


def test_joints_that_no_spare_freedom_brings_to_their_sum_do_not_arrive() -> None:
    task = possible("iiwa14", np.random.default_rng(4), poses=2, step=0.5)
    limits = LinearLimits(("sum",), np.eye(7)[:1], np.array([5.0]), np.array([6.0]))
    arm = replace(task.arm, linear_limits=limits)
    base = task.arm.base_in_world(task.position, task.yaw)
    flange = base @ flange_poses(arm.robot, task.joints)
    joints, arrived = keep_inside(arm, base, flange, task.joints)
    assert not np.any(arrived)
    assert np.all(np.isfinite(joints))


def past_stretched(elbow: float, outwards: float = 0.0) -> tuple[Cell, Arm, ArmSolution]:
    """A PUMA whose hand turns about a point in front of its shoulder, which stretches the elbow most at 3/7 of the way:
    all but ``elbow`` rad; then all of the way is moved ``outwards`` m.
    """
    robot = catalogue.robot("puma560")
    form, chain = form_of(robot), chain_of(robot)
    q = np.array([0.0, 0.3, -form.turns[2] * form.planar.elbow_angle + elbow, 0.4, 0.8, 0.2])
    flange, axis = flange_poses(robot, q)[0], chain.axes[1]
    wrist = flange[:3, 3] + flange[:3, :3] @ form.wrist_in_flange
    shoulder = chain.points[1] + axis * (axis @ (wrist - chain.points[1]))
    along = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    middle = transform(np.eye(3), shoulder + 0.5 * (wrist - shoulder))
    angles = np.array([-0.3, 0.0, 0.4])
    poses = transform(rotation_about(axis, angles), middle[:3, 3] + outwards * along)
    arm = make_arm("puma560", grasp=inverse(middle) @ flange)
    signs = posture_of(form, q + 1e-3 * np.eye(6)[2] if elbow == 0.0 else q)
    flanges = (poses @ arm.grasp)[::2]
    found = solve_signed(form, flanges[:, :3, :3], flanges[None, :, :3, 3], np.array([signs]))
    joints = found.joints[:, 0, 0].T
    return Cell(Task(poses[::2]), (arm,), np.pi), arm, ArmSolution(np.zeros(3), 0.0, joints, signs)


@pytest.mark.parametrize(
    ("elbow", "outwards", "free"),
    [(2e-3, 0.0, True), (5e-4, 0.0, False), (0.0, 0.0, False), (0.0, 2e-6, False), (0.0, -1e-4, True)],
)
def test_an_elbow_that_is_all_but_stretched_between_two_poses_is_seen(
    elbow: float, outwards: float, free: bool
) -> None:
    checked = check_arm_path(*past_stretched(elbow, outwards))
    assert checked.samples < 100
    assert (not checked.breaks) == free
    if not free:
        assert checked.breaks[0].fraction == pytest.approx(3.0 / 7.0, abs=0.02)
        (reason,) = arm_path_faults(checked.breaks, ())
        assert "touches a singularity of shoulder, elbow or wrist; add a pose between 0 and 1" in reason.detail


def stretched_at(pose: int) -> tuple[Cell, Arm, ArmSolution]:
    """The elbow of `past_stretched` stretched exactly at one of three poses, the others to one side of it."""
    cell, arm, point = past_stretched(0.0)
    ends = cell.task.poses
    step = rotation_vector(ends[0, :3, :3].T @ ends[1, :3, :3])
    peak = (0.0, 3.0 / 7.0, 1.0)
    fractions = {0: (3.0 / 7.0, 0.7, 1.0), 1: peak, 2: (0.0, 0.2, 3.0 / 7.0)}[pose]
    form, angle = form_of(arm.robot), float(np.linalg.norm(step))
    turns = rotation_about(step / angle, angle * np.array(fractions))
    poses = transform(ends[0, :3, :3] @ turns, np.tile(ends[0, :3, 3], (3, 1)))
    flanges = poses @ arm.grasp
    found = solve_signed(form, flanges[:, :3, :3], flanges[None, :, :3, 3], np.array([point.signs]))
    joints = found.joints[:, 0, 0].T.copy()
    joints[pose, 2] = -form.turns[2] * form.planar.elbow_angle
    return replace(cell, task=Task(poses)), arm, replace(point, joints=joints)


def test_a_way_may_begin_and_end_at_a_singularity_but_not_go_through_one() -> None:
    assert [check_arm_path(*stretched_at(pose)).free for pose in range(3)] == [True, False, True]
    cell, arm, point = stretched_at(1)
    (found, *_) = check_arm_path(cell, arm, point).breaks
    assert (found.pose, found.fraction) == (1, 0.0)
    alone = replace(cell, task=Task(cell.task.poses, starts=(0, 1, 2)))
    assert check_arm_path(alone, arm, point).free


def test_a_small_overshoot_between_poses_is_told_and_does_not_count() -> None:
    """Limits lie where the poses end: ways that bend beyond them do so by little or by much."""
    seen = set()
    for seed in range(40):
        task, point = given("puma560", seed, step=0.6)
        ends = np.max(point.joints, axis=0)
        for joint in range(6):
            free = np.full(6, 20.0)
            free[joint] = ends[joint]
            arm = replace(task.arm, lower=-np.full(6, 20.0), upper=free)
            checked = check_arm_path(task.cell, arm, point)
            if checked.breaks or not checked.excesses:
                continue
            (one,) = checked.excesses
            counts = one.amount > np.radians(1.0)
            assert bool(checked.beyond) == counts
            assert checked.tolerable == (not counts)
            assert not checked.free
            seen.add(counts)
    assert seen == {True, False}
