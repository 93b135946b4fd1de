"""Long tasks on some of their poses: what stands for the others, and layouts carried over to all of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances, Surroundings
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.coupled.candidates.short_task import ShortTask, shortened
from duocell.optimizer.coupled.search import search_coupled
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.scene import Scene
from duocell.optimizer.verification.verify import check
from tests.support.given.arms import make_arm, region
from tests.support.given.fields import CellFields
from tests.support.present import present

MANY = 240


def corrected(count: int = MANY) -> Task:
    """Along x, then up, then along y, with a turn on the last stretch; evenly in time."""
    corners = np.array([[0.0, 0.0, 0.5], [0.4, 0.0, 0.5], [0.4, 0.0, 0.8], [0.4, 0.4, 0.8]])
    at = np.linspace(0.0, 3.0, count)
    positions = np.stack([np.interp(at, np.arange(4), corners[:, axis]) for axis in range(3)], axis=-1)
    turned = np.array([rotation_z(0.5 * max(0.0, t - 2.0)) for t in at])
    return Task(transform(turned, positions))


def cell(task: Task, **more: Unpack[CellFields]) -> Cell:
    arm = make_arm("ur10e", "arm", region((-0.9, 1.2), (-0.9, 1.2)))
    return Cell(task, (arm,), **more)


def test_poses_at_corners_are_kept_and_weights_stay_where_they_are() -> None:
    task = corrected()
    poses, short = shortened(task, 20)
    assert len(poses) < 45
    assert {0, MANY - 1} <= set(poses.tolist())
    for corner in (0.4, 0.0, 0.5), (0.4, 0.0, 0.8):
        assert np.min(np.linalg.norm(short.poses[:, :3, 3] - corner, axis=1)) < 5e-3
    assert np.sum(short.weights) == pytest.approx(np.sum(task.weights), rel=1e-12)
    middle = task.weights @ task.poses[:, :3, 3], short.weights @ short.poses[:, :3, 3]
    assert middle[1] == pytest.approx(middle[0], abs=2e-3 * MANY)


def test_a_dwell_keeps_its_weight_and_reversal_keeps_the_choice() -> None:
    dwell = np.concatenate([corrected(100).poses, np.repeat(corrected(100).poses[-1:], 140, axis=0)])
    poses, short = shortened(Task(dwell), 20)
    rested = np.linalg.norm(short.poses[:, :3, 3] - dwell[-1, :3, 3], axis=1) < 1e-9
    assert np.sum(short.weights[rested]) >= 140.0
    back, reverse = shortened(Task(dwell[::-1].copy()), 20)
    assert len(back) == len(poses)
    np.testing.assert_allclose(reverse.poses[::-1, :3, 3], short.poses[:, :3, 3], atol=1e-9)


def test_segments_stay_apart() -> None:
    task = replace(corrected(), starts=(0, 1, 100), names=("a", "b", "c"))
    poses, short = shortened(task, 20)
    assert short.names == ("a", "b", "c")
    assert [int(poses[start]) for start in short.starts] == [0, 1, 100]
    assert {0, 1, 99, 100, MANY - 1} <= set(poses.tolist())


def test_a_layout_is_carried_over_to_all_poses() -> None:
    whole = cell(corrected())
    problem = present(reduced_problem(whole, whole.arms[0]))
    short = ShortTask.of(Scene.of(whole), [problem], 20)
    own = evaluate(short.short_problems[0], np.array([[-0.4, -0.3, 0.0]]))
    usable = np.flatnonzero(own.violation[:, 0] == 0.0)
    assert len(usable)
    for k in usable:
        point = ArmSolution(np.array([-0.4, -0.3, 0.0]), float(own.yaw[k, 0]), own.joints[:, k, 0].T, ALL_SIGNS[k])
        start = short.on_whole([point])
        assert start is not None
        assert start.points[0].joints[short.poses] == pytest.approx(point.joints, abs=1e-9)
        assert check(whole, whole.arms[0], start.points[0]).usable
        assert start.objective == pytest.approx(own.objective[k, 0], rel=2e-2)


def test_a_long_task_beside_an_obstacle_is_solved_on_all_its_poses() -> None:
    free = cell(corrected())
    alone = search_arm(free, free.arms[0], Settings(), np.inf)
    x, y, _ = present(alone.best).position
    block = Body("block", transform(np.eye(3), [x, y, 0.3]), Box(np.array([0.25, 0.25, 0.6])))
    blocked = cell(corrected(), surroundings=Surroundings((block,), clearances=Clearances(arm_obstacle=0.02)))
    search = search_coupled(blocked, [search_arm(blocked, blocked.arms[0], Settings(), np.inf)], Settings(), np.inf)
    assert search.best is not None
    assert len(search.best.points[0].joints) == MANY
    assert search.best.objective > alone.objective
    scene = Scene.of(blocked)
    assert scene.certify(search.best.points).clear
    assert scene.usable(search.best.points)
