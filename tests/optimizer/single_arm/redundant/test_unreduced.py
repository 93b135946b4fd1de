"""The search of arms without a reduced problem, against witnesses, known layouts, and itself seen otherwise."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.chain import chain_of
from duocell.models.robot.arm import Arm, BaseRegion, Interval
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.parameters.unreduced import PARAMETERS
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.layers import LayeredPath
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.continuation import continue_paths
from duocell.optimizer.single_arm.redundant.ranking import distinct, figures
from duocell.optimizer.single_arm.redundant.stages import staged
from duocell.optimizer.single_arm.redundant.unreduced import _Nets, _one_of_a_kind, _recombined
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, unreduced_problem
from duocell.optimizer.single_arm.redundant.varied_paths import varied_paths
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.verify import check
from tests.support.given.task_sequences import possible_task_sequence
from tests.support.given.tasks import possible
from tests.support.oracles.answers import reached

CASES = [
    ("iiwa14", np.eye(3)),
    ("fanuc_crx10ia", np.eye(3)),
    ("yumi_left", np.eye(3)),
    ("iiwa14", rotation_about((1.0, 0.2, 0.0), 2.0)),
]

DWELL = 1708.8586
"""What eight times as many seeds find where the dwell counts as one pose with the weight of all."""


def found(cell: Cell) -> float:
    """Objective of the search's answer, which is usable."""
    search = search_arm(cell, cell.arms[0], Settings(), time.perf_counter() + 600.0)
    assert search.best is not None, search.reasons
    assert check(cell, cell.arms[0], search.best).usable
    return search.objective


def seen_otherwise(cell: Cell, quarters: int, shift: Floats) -> Cell:
    """The same cell in a world that is turned by quarter turns and shifted, its poses reversed."""
    arm, turn = cell.arms[0], np.round(rotation_z(quarters * np.pi / 2))
    bounds = arm.base.bounds
    corners = np.array([[x, y] for x in bounds[0] for y in bounds[1]]) @ turn[:2, :2].T + shift[:2]
    sides = [Interval(*map(float, side)) for side in zip(corners.min(axis=0), corners.max(axis=0), strict=True)]
    yaw = arm.base.yaw
    if not arm.base.yaw_free:
        yaw = Interval(yaw.low + quarters * np.pi / 2, yaw.high + quarters * np.pi / 2)
    base = BaseRegion(sides[0], sides[1], Interval(bounds[2, 0] + shift[2], bounds[2, 1] + shift[2]), yaw)
    poses = (transform(turn, shift) @ cell.task.poses)[::-1]
    return replace(cell, task=Task(poses), arms=(replace(arm, base=base),))


@pytest.mark.parametrize(("name", "mount"), CASES, ids=lambda v: v if isinstance(v, str) else "")
def test_no_answer_is_worse_than_the_witness(name: str, mount: Floats) -> None:
    task = possible(name, np.random.default_rng(12), poses=5, half=(0.3, 0.3, 0.0, 0.5), mount=mount)
    assert found(task.cell) <= objective_of(task.cell, task.arm, task.joints) * (1.0 + 1e-6)


@pytest.mark.parametrize("name", ["iiwa14", "xarm7"])
def test_task_sequences_are_served_by_one_base(name: str) -> None:
    task = possible_task_sequence(name, np.random.default_rng(13), (1.0, 0.3, 2.0), half=(0.4, 0.4, 0.0, np.pi))
    assert found(task.cell) <= objective_of(task.cell, task.arm, task.joints) * (1.0 + 1e-6)


def test_an_answer_does_not_depend_on_how_the_world_is_seen() -> None:
    task = possible("iiwa14", np.random.default_rng(14), poses=6, half=(0.3, 0.4, 0.1, 0.6))
    here = found(task.cell)
    for quarters, shift in ((1, np.zeros(3)), (2, np.array([10.0, -7.0, 3.0]))):
        assert found(seen_otherwise(task.cell, quarters, shift)) == pytest.approx(here, rel=1e-6)


def test_small_steps_and_conditioning_are_kept() -> None:
    task = possible("iiwa14", np.random.default_rng(15), poses=8, step=0.03, max_joint_step=0.2, min_conditioning=0.03)
    assert found(task.cell) <= objective_of(task.cell, task.arm, task.joints) * (1.0 + 1e-6)


def test_long_tasks_are_solved_on_key_poses_first() -> None:
    task = possible("franka_panda", np.random.default_rng(16), poses=150, step=0.004, half=(0.3, 0.3, 0.0, np.pi))
    assert found(task.cell) <= objective_of(task.cell, task.arm, task.joints) * (1.0 + 1e-6)


def test_a_dwell_does_not_keep_the_base_where_other_poses_are_out_of_reach() -> None:
    cell = possible("xarm7", np.random.default_rng([5, 2]), poses=8, step=0.15, half=(1.0, 1.0, 0.0, np.pi)).cell
    rows = np.sort(np.append(np.arange(8), np.full(210, 3)))
    assert found(replace(cell, task=Task(cell.task.poses[rows]))) <= DWELL * (1.0 + 1e-3)


def test_one_optimum_in_several_guises_is_solved_once() -> None:
    task = possible("jaco2", np.random.default_rng(18), half=(0.3, 0.3, 0.0, np.pi))
    problem = unreduced_problem(task.cell, task.arm, search_box(task.cell, task.arm))
    base = np.array([*(task.position - problem.origin), task.yaw])
    sigma = chain_of(task.arm.robot).vertical_sign
    guises = []
    for turn in (0.0, 1.0, 2.5):
        joints = task.joints.T + sigma * turn * np.eye(task.arm.dof)[0][:, None]
        guises.append(Seeds(joints[:, :, None], (base - [0.0, 0.0, 0.0, turn])[None]))
    off_the_task = Seeds(guises[0].joints, guises[0].bases + 0.01)
    seeds = guises[0].join(guises[1]).join(guises[2]).join(off_the_task)
    assert np.all(figures(problem, seeds).error[:3] < 1e-6)
    assert _one_of_a_kind(problem, seeds, PARAMETERS) == [0, 3]


def real(cell: Cell, arm: Arm, path: LayeredPath) -> None:
    """A path stands in its region and reaches every pose, or says by how much it breaks a limit."""
    bounds = arm.base.bounds
    assert np.all(path.position >= bounds[:3, 0] - 1e-9)
    assert np.all(path.position <= bounds[:3, 1] + 1e-9)
    assert bounds[3, 0] - 1e-9 <= path.yaw <= bounds[3, 1] + 1e-9
    for pose, q in zip(cell.task.poses, path.joints, strict=True):
        assert np.abs(reached(arm, path.position, path.yaw, q) - pose).max() < 1e-3
    out = np.maximum(arm.lower - path.joints.min(0), 0) + np.maximum(path.joints.max(0) - arm.upper, 0)
    step = np.abs(np.diff(path.joints, axis=0)).max()
    assert path.violation == pytest.approx(out.sum() + max(step - cell.max_joint_step, 0.0), abs=1e-8)
    assert path.objective == pytest.approx(np.sum(arm.weights * (path.joints - arm.reference) ** 2))


@pytest.mark.parametrize(("name", "mount"), CASES, ids=lambda v: v if isinstance(v, str) else "")
def test_paths_from_many_bases_reach_every_pose_and_come_in_order(name: str, mount: Floats) -> None:
    task = possible(name, np.random.default_rng(2), poses=4, step=0.06, half=(0.2, 0.2, 0.0, 0.5), mount=mount)
    paths = varied_paths(task.cell, task.arm, search_box(task.cell, task.arm), 0).paths
    usable = [path for path in paths if path.violation == 0.0]
    assert len(usable) > 10
    assert len({tuple(np.round(path.position / 0.04)) for path in usable}) > 5
    for path in paths:
        real(task.cell, task.arm, path)
    objectives = [path.objective for path in usable]
    assert objectives == [path.objective for path in paths[: len(usable)]] == sorted(objectives)


def test_continued_paths_reach_every_pose_and_are_repeatable() -> None:
    task = possible("franka_panda", np.random.default_rng(3), poses=6, step=0.05, half=(0.3, 0.3, 0.1, np.pi))
    area = np.concatenate([search_box(task.cell, task.arm), [[0.0, 0.0]]])
    first, second = (continue_paths(task.cell, task.arm, area, 5, 64) for _ in range(2))
    assert len(first) > 5
    for a, b in zip(first, second, strict=True):
        real(task.cell, task.arm, a)
        assert np.array_equal(a.joints, b.joints)


def test_the_second_net_starts_from_the_seeds_that_were_left_where_no_candidate_took_every_pose() -> None:
    task = possible("iiwa14", np.random.default_rng(19), half=(0.3, 0.3, 0.0, np.pi))
    problem = unreduced_problem(task.cell, task.arm, search_box(task.cell, task.arm))
    staged_ = staged(problem, PARAMETERS, 0)
    assert staged_ is not None
    none = np.zeros(0, dtype=np.int64)
    nets = _Nets(0, time.perf_counter() + 600.0, lambda *_: [], PARAMETERS, np.inf)
    emptied = replace(staged_, seeds=staged_.seeds.take(none), figures=staged_.figures.take(none))
    second = _recombined(emptied, nets)
    assert len(second)
    assert np.min(figures(problem, second).error) < 1e-3
    assert not len(distinct(problem, second.take(none), none, 4, 0.1, 0.1))
