"""Paths of the judge are held against Pinocchio, their cost and yaw against plain search over both."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from bench.searches.own_stands import conditioning, own_stands, own_task
from bench.trials.coupled_tasks import coupled_task
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.kinematics import characteristic_length, flange_poses, jacobians
from duocell.models.robot.arm import Interval


def _cells() -> list[Cell]:
    """One arm each: plain, with a narrow yaw, and the path cut into two segments."""
    drawn = coupled_task(3)
    cell = replace(drawn.cell, couplings=(), arms=drawn.cell.arms[1:])
    arm, yaw = cell.arms[0], float(drawn.known.stands[1, 3])
    narrow = replace(arm, base=replace(arm.base, yaw=Interval(yaw - 0.05, yaw + 0.2)))
    return [cell, replace(cell, arms=(narrow,)), replace(cell, task=Task(cell.task.poses, (0, 2)))]


@pytest.mark.parametrize("which", range(3))
def test_paths_and_cost(which: int) -> None:
    cell = _cells()[which]
    arm = cell.arms[0]
    known = coupled_task(3).known.stands[1, :3]
    places = known + np.random.default_rng(which).normal(0.0, 0.05, (6, 3))
    found = own_stands(own_task(cell, 0), places)
    assert found.usable.any()
    for branch, k in np.argwhere(found.usable)[::5]:
        q, yaw = found.joints[branch, k], float(found.yaw[branch, k])
        assert arm.base.yaw_outside(yaw) < 1e-9
        assert np.all((arm.lower - 1e-9 <= q) & (q <= arm.upper + 1e-9))
        hands = arm.base_in_world(places[k], yaw) @ flange_poses(arm.robot, q) @ arm.tool
        np.testing.assert_allclose(hands, cell.task.poses @ cell.grasps(arm), atol=1e-7)
        np.testing.assert_allclose(found.objective[branch, k], np.sum(arm.weights * (q - arm.reference) ** 2))
        assert found.objective[branch, k] <= _best_by_scan(cell, q, yaw) * (1.0 + 1e-9) + 1e-9


def _best_by_scan(cell: Cell, joints: Floats, yaw: float) -> float:
    """Least cost of the same postures over hundreds of yaws and all whole turns of joint 1."""
    arm = cell.arms[0]
    sense = np.sign(arm.robot.joint_placements[0][2, :3] @ arm.robot.joint_axes[0])
    rest = float(np.sum((arm.weights * (joints - arm.reference) ** 2)[:, 1:]))
    best = np.inf
    for shift in np.linspace(-np.pi, np.pi, 301):
        if arm.base.yaw_outside(yaw + shift) > 0.0:
            continue
        total = 0.0
        for segment in cell.task.segments:
            turned = [joints[segment, 0] - sense * shift + 2.0 * np.pi * n for n in range(-3, 4)]
            inside = [t for t in turned if np.all((arm.lower[0] <= t) & (t <= arm.upper[0]))]
            total += min((float(arm.weights[0] * np.sum((t - arm.reference[0]) ** 2)) for t in inside), default=np.inf)
        best = min(best, total)
    return rest + best


def test_conditioning() -> None:
    cell = _cells()[0]
    task, arm = own_task(cell, 0), cell.arms[0]
    joints = np.random.default_rng(1).uniform(-2.0, 2.0, (20, 6))
    jacobian = jacobians(arm.robot, joints, arm.tool)
    jacobian[:, :3] /= characteristic_length(arm.robot)
    values = np.linalg.svd(jacobian, compute_uv=False)
    np.testing.assert_allclose(conditioning(task, joints), values[:, -1] / values[:, 0], atol=1e-12)


def test_a_given_yaw_is_kept() -> None:
    drawn = coupled_task(3)
    for index, stand in enumerate(drawn.known.stands):
        found = own_stands(own_task(drawn.cell, index), stand[None, :3], stand[3:])
        arm = drawn.cell.arms[index]
        base = inverse(arm.base_in_world(stand[:3], float(stand[3])))
        targets = base @ drawn.cell.flange_targets(arm)
        branch = int(np.argmax(found.usable[:, 0]))
        np.testing.assert_allclose(flange_poses(arm.robot, found.joints[branch, 0]), targets, atol=1e-7)


def test_turns_of_two_segments_are_chosen_together() -> None:
    """Two segments whose best yaws differ: no pair of turns and no yaw of a scan is better; this scans turns
    outright.
    """
    cell = _cells()[2]
    found = own_stands(own_task(cell, 0), coupled_task(3).known.stands[1:, :3])
    arm = cell.arms[0]
    branch = int(np.argmax(found.usable[:, 0]))
    q, first = found.joints[branch, 0], cell.task.segments
    for turns in product((-1, 0, 1), repeat=2):
        moved = np.concatenate([q[segment, 0] + 2.0 * np.pi * n for segment, n in zip(first, turns, strict=True)])
        shift = arm.reference[0] - moved.mean()
        best = moved + shift
        if np.all((arm.lower[0] <= best) & (best <= arm.upper[0])):
            miss = np.sum((best - arm.reference[0]) ** 2)
            assert np.sum((q[:, 0] - arm.reference[0]) ** 2) <= miss + 1e-9
