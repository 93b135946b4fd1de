"""The reduced problem against Pinocchio, direct recomputation and every winding and yaw tried one by one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_angle, rotation_x, rotation_z, transform
from duocell.models.cell.task import Task
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses
from duocell.models.robot.posture import ALL_SIGNS, Posture
from duocell.optimizer.reduction.reduced import conditioning_shortfall, evaluate, evaluate_signed, reduced_problem
from tests.support.angles import wrapped
from tests.support.given.arms import make_arm, region
from tests.support.given.tasks import Possible, possible
from tests.support.oracles.brute import USELESS, path_cost
from tests.support.present import present

CASES = ("puma560", "ur10e", "kr6_r900", "j2s6s300", "ur3e", "rx160", "irb120", "hh020", "z1", "ceiling", "wall")
MOUNTS = {"ceiling": ("ur5e", rotation_x(np.pi)), "wall": ("puma560", rotation_x(1.2))}
YAWS = {"puma560": np.pi, "ur10e": 0.3, "kr6_r900": 0.0, "ur3e": 1.0, "rx160": 2.5}


@cache
def case(name: str) -> tuple[Possible, Floats]:
    """A possible task and base positions around its witness."""
    rng = np.random.default_rng(17)
    robot, mount = MOUNTS.get(name, (name, np.eye(3)))
    task = possible(robot, rng, poses=4, half=(0.5, 0.5, 0.0, YAWS.get(name, np.pi)), mount=mount)
    positions = np.concatenate([task.position[None], task.position + rng.uniform(-0.15, 0.15, (40, 3))])
    return task, positions


@pytest.mark.parametrize("name", CASES)
def test_paths_reach_every_pose_at_the_yaw_they_come_with(name: str) -> None:
    task, positions = case(name)
    problem = present(reduced_problem(task.cell, task.arm))
    paths = evaluate(problem, positions)
    wanted = task.cell.flange_targets(task.arm)
    tried = 0
    for k, i in zip(*np.nonzero(paths.missing == 0.0), strict=True):
        base = transform(task.arm.mount @ rotation_z(paths.yaw[k, i]), positions[i])
        reached = base @ flange_poses(task.arm.robot, paths.joints[:, k, i].T)
        assert np.linalg.norm(reached[:, :3, 3] - wanted[:, :3, 3], axis=1).max() < 1e-6
        assert rotation_angle(np.swapaxes(wanted[:, :3, :3], 1, 2) @ reached[:, :3, :3]).max() < 1e-6
        tried += 1
    assert tried > 20


@pytest.mark.parametrize("name", CASES)
def test_figures_are_those_of_the_returned_joints(name: str) -> None:
    task, positions = case(name)
    arm = task.arm
    cell = replace(task.cell, max_joint_step=0.3)
    paths = evaluate(present(reduced_problem(cell, arm)), positions)
    for k, i in np.ndindex(8, len(positions)):
        joints = paths.joints[:, k, i].T
        expected = np.sum(arm.weights * (joints - arm.reference) ** 2)
        assert paths.objective[k, i] == pytest.approx(expected, rel=1e-12)
        out = np.maximum(arm.lower - joints.min(axis=0), 0.0) + np.maximum(joints.max(axis=0) - arm.upper, 0.0)
        assert paths.beyond[k, i] == pytest.approx(out.sum(), abs=1e-9)
        steps = np.abs(np.diff(joints, axis=0)).max()
        assert paths.jump[k, i] == pytest.approx(max(steps - 0.3, 0.0), abs=1e-12)
        assert steps <= np.pi + 1e-12
        assert arm.base.yaw.low <= paths.yaw[k, i] <= arm.base.yaw.high
    total = paths.missing + paths.beyond + paths.jump
    assert np.array_equal(paths.violation, total)


@pytest.mark.parametrize("name", CASES)
def test_yaw_and_lifts_are_the_best_there_are(name: str) -> None:
    """Against all turns and yaws tried one by one; what they find impossible is reported as a violation."""
    task, positions = case(name)
    paths = evaluate(present(reduced_problem(task.cell, task.arm)), positions)
    sigma = present(reduced_problem(task.cell, task.arm)).sigma
    usable = 0
    for k, i in zip(*np.nonzero(paths.missing == 0.0), strict=True):
        joints = paths.joints[:, k, i].T.copy()
        joints[:, 0] += sigma * paths.yaw[k, i]  # joint 1 at yaw 0
        best = path_cost(task.cell, task.arm, wrapped(joints))
        if paths.violation[k, i] == 0.0:
            assert paths.objective[k, i] == pytest.approx(best, rel=1e-9)
            usable += 1
        else:
            assert best == USELESS
    assert usable > 0


@pytest.mark.parametrize("name", CASES)
def test_a_chosen_posture_gives_the_same_numbers(name: str) -> None:
    task, positions = case(name)
    problem = present(reduced_problem(task.cell, task.arm))
    every = evaluate(problem, positions)
    for k, signs in enumerate(ALL_SIGNS):
        one = evaluate_signed(problem, positions, np.tile(signs, (len(positions), 1)))
        for field in ("yaw", "objective", "missing", "beyond", "jump"):
            assert np.allclose(getattr(one, field)[0], getattr(every, field)[k], rtol=1e-9, atol=1e-9), field
        assert np.allclose(one.joints[:, 0], every.joints[:, k], rtol=0.0, atol=1e-9)


def test_the_witness_is_among_the_usable_paths() -> None:
    for name in CASES:
        task, positions = case(name)
        paths = evaluate(present(reduced_problem(task.cell, task.arm)), positions[:1])
        cost = float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2))
        assert paths.objective[:, 0][paths.violation[:, 0] == 0.0].min() <= cost + 1e-9


def test_postures_that_are_not_asked_for_are_out() -> None:
    task, positions = case("puma560")
    arm = replace(task.arm, posture=Posture(shoulder=1, wrist=-1))
    paths = evaluate(present(reduced_problem(task.cell, arm)), positions)
    for k, signs in enumerate(ALL_SIGNS):
        assert np.all(np.isinf(paths.violation[k])) == (signs[0] != 1 or signs[2] != -1)


def test_arms_without_a_closed_form_or_with_a_tilted_first_axis_have_no_reduced_problem() -> None:
    task, _ = case("puma560")
    assert reduced_problem(task.cell, make_arm("iiwa14")) is None
    assert reduced_problem(task.cell, make_arm("fanuc_crx10ia")) is None
    robot = make_arm("ur5e").robot
    placements = robot.joint_placements.copy()
    placements[0] = transform(rotation_x(0.3), np.zeros(3)) @ placements[0]
    assert reduced_problem(task.cell, make_arm(replace(robot, joint_placements=placements))) is None
    assert reduced_problem(task.cell, make_arm("ur5e")) is not None
    assert reduced_problem(task.cell, make_arm("ur5e", mount=rotation_x(np.pi))) is not None


@pytest.mark.parametrize("poses", [2, 16, 40, 300])
def test_a_sample_of_a_long_task_keeps_its_ends_and_its_turns(poses: int) -> None:
    rng = np.random.default_rng(1)
    task = possible("puma560", rng, poses=poses, step=0.6 / poses)
    problem = present(reduced_problem(task.cell, task.arm))
    small = problem.sampled(16)
    if poses <= 16:
        assert small is problem
        return
    assert 16 <= len(small.positions) <= 40
    for end in (0, -1):
        assert np.array_equal(small.positions[end], problem.positions[end])
        assert np.array_equal(small.rotations[end], problem.rotations[end])
    assert small.max_step == np.inf
    turned = rotation_angle(np.swapaxes(small.rotations[:-1], 1, 2) @ small.rotations[1:])
    gaps = turned + np.linalg.norm(np.diff(small.positions, axis=0), axis=1)
    assert gaps.max() < 1.0


def test_a_part_at_rest_is_sampled_by_its_two_ends() -> None:
    task, _ = case("puma560")
    still = replace(task.cell, task=Task(np.repeat(task.cell.task.poses[:1], 50, axis=0)))
    small = present(reduced_problem(still, task.arm)).sampled(16)
    assert len(small.positions) == 2


def test_violations_are_made_dear_and_dearer() -> None:
    task, _ = case("puma560")
    problem = present(reduced_problem(task.cell, task.arm))
    here, there = np.array([5.0]), np.array([0.1])
    assert problem.score(here, np.zeros(1)) == 5.0
    assert problem.score(here, there) > 5.0
    assert problem.stricter(10.0).score(here, there) - 5.0 == pytest.approx(10.0 * (problem.score(here, there) - 5.0))
    alone = evaluate(problem.stricter(np.inf), task.position[None])
    assert np.all(alone.objective == 0.0)


def test_shortfall_of_conditioning_is_that_of_the_worst_pose() -> None:
    task, positions = case("ur10e")
    arm = replace(task.arm, min_conditioning=0.15, tool=transform(np.eye(3), [0.0, 0.1, 0.2]))
    problem = present(reduced_problem(task.cell, arm))
    joints = evaluate(problem, positions).joints[:, 0]
    length = characteristic_length(arm.robot)
    worst = np.array([conditioning(arm.robot, arm.tool, path.T, length).min() for path in np.moveaxis(joints, 1, 0)])
    shortfall = conditioning_shortfall(problem, joints)
    assert np.array_equal(shortfall > 0.0, worst < 0.15)
    short = worst < 0.15
    ratio = shortfall[short] / (0.15 - worst[short])
    assert ratio == pytest.approx(np.full(short.sum(), ratio[0]))


def test_endless_joints_are_never_beyond_and_cost_nothing() -> None:
    task, positions = case("j2s6s300")
    arm = task.arm
    endless = np.isinf(arm.upper)
    assert endless.sum() == 3
    paths = evaluate(present(reduced_problem(task.cell, arm)), positions)
    spread = np.abs(paths.joints[endless].mean(axis=-1) - arm.reference[endless][:, None, None])
    assert spread.max() <= np.pi + 1e-9 or np.all(arm.weights[endless] == 0.0)
    limited = replace(arm, weights=np.where(endless, 0.0, arm.weights))
    again = evaluate(present(reduced_problem(task.cell, limited)), positions)
    assert np.array_equal(again.objective, paths.objective)


def test_base_far_away_is_missing_and_scored_worse_with_distance() -> None:
    task, _ = case("ur10e")
    away = task.position + np.array([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    paths = evaluate(present(reduced_problem(task.cell, replace(task.arm, base=region((-9, 9), (-9, 9))))), away)
    assert np.all(np.diff(paths.missing, axis=1) > 3.0)  # four poses, a metre each


def test_a_sample_limits_its_steps_by_what_the_poses_left_out_allow() -> None:
    task = possible("ur10e", np.random.default_rng(3), poses=40)
    free = present(reduced_problem(replace(task.cell, max_joint_step=np.pi), task.arm))
    path = evaluate(free, task.position[None])
    k = int(np.argmin(np.where(path.violation[:, 0] == 0.0, path.objective[:, 0], np.inf)))
    joints = path.joints[:, k, 0].T
    largest = float(np.max(np.abs(np.diff(joints, axis=0))))
    for step in (1.000001 * largest, 0.5 * largest):
        problem = present(reduced_problem(replace(task.cell, max_joint_step=step), task.arm))
        small = problem.sampled(8)
        keep = [int(np.flatnonzero(np.all(problem.positions == p, axis=1))[0]) for p in small.positions]
        allowed = np.diff(keep) * step
        assert np.array_equal(present(small.gap_steps), np.where(allowed < np.pi, allowed, np.inf))
        excess = np.max(np.abs(np.diff(joints[keep], axis=0)) - present(small.gap_steps)[:, None])
        sampled = evaluate(small, task.position[None])
        assert (sampled.violation[k, 0] > 0.0) == (excess > 0.0) == (step < largest)
    assert free.sampled(8).gap_steps is None
