"""Unknowns, directions and the way back: every arm stays on its task, whatever its unknowns do."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.kinematics import flange_poses
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.manifold import Directions, Unknowns, directions, move
from duocell.optimizer.sqp.quadratic import quadratic
from tests.support.given.arms import make_arm
from tests.support.given.tasks import possible

NAMES = ["puma560", "ur10e", "fanuc_crx10ia", "iiwa14"]


def layout(name: str, poses: int = 4) -> tuple[Cell, ArmSolution, Unknowns, list[Directions]]:
    task = possible(name, np.random.default_rng(3), poses=poses)
    point = ArmSolution(task.position, task.yaw, task.joints, None)
    unknowns = Unknowns.of(task.cell)
    base = task.arm.base_in_world(point.position, point.yaw)
    return task.cell, point, unknowns, [directions(task.arm, base[:3, :3], point.joints)]


def error(cell: Cell, point: ArmSolution) -> float:
    arm = cell.arms[0]
    reached = arm.base_in_world(point.position, point.yaw) @ flange_poses(arm.robot, point.joints)
    return float(np.abs(reached - cell.flange_targets(arm)).max())


@pytest.mark.parametrize("name", NAMES)
def test_a_moved_layout_is_exactly_on_its_task_and_moves_as_the_directions_say(name: str) -> None:
    cell, point, unknowns, along = layout(name)
    rng = np.random.default_rng(8)
    for size in (1e-2, 1e-5):
        step = size * rng.normal(size=unknowns.count)
        moved, missing = move(cell, [point], along, unknowns, step)
        assert missing == 0.0
        assert error(cell, moved[0]) < 1e-7
        assert np.allclose(moved[0].position - point.position, step[:3], atol=1e-12)
    change = moved[0].joints - point.joints
    expected = along[0].by_base @ step[:4]
    if unknowns.nullspace[0]:
        expected = expected + np.einsum("mnd,md->mn", along[0].by_nullspace, step[4:].reshape(len(cell.task), -1))
    assert np.abs(change - expected).max() < 1e-7


def test_unknowns_of_redundant_arms_are_counted_pose_by_pose() -> None:
    cell = Cell(Task(np.tile(np.eye(4), (3, 1, 1))), (make_arm("iiwa14", "a"), make_arm("puma560", "b")))
    unknowns = Unknowns.of(cell)
    assert unknowns.count == 8 + 3
    assert unknowns.own(0, 3).tolist() == [0, 1, 2, 3, 8, 9, 10]
    assert unknowns.own(1, 3).tolist() == [4, 5, 6, 7]


def test_a_step_that_no_arm_can_follow_is_refused() -> None:
    cell, point, unknowns, along = layout("puma560")
    _, missing = move(cell, [point], along, unknowns, np.array([5.0, 0.0, 0.0, 0.0]))
    assert missing > 1.0


@pytest.mark.parametrize("name", NAMES)
def test_the_model_of_the_objective_is_right_to_first_and_for_plain_arms_to_second_order(name: str) -> None:
    cell, point, unknowns, along = layout(name)
    model = quadratic(cell, [point], along, unknowns)
    rng = np.random.default_rng(1)
    start = objective_of(cell, cell.arms[0], point.joints)
    for _ in range(5):
        way = rng.normal(size=unknowns.count)

        def cost(step: float, way: Floats = way) -> float:
            moved, _ = move(cell, [point], along, unknowns, step * way)
            return objective_of(cell, cell.arms[0], moved[0].joints)

        assert (cost(1e-4) - cost(-1e-4)) / 2e-4 == pytest.approx(float(model.gradient @ way), rel=1e-4, abs=1e-3)
        wide = 2e-3  # followed joints are good to 1e-8: closer differences of second order are noise
        bend = (cost(wide) + cost(-wide) - 2.0 * start) / wide**2
        if not unknowns.nullspace[0]:  # raised where it is not convex, true elsewhere
            assert float(way @ model.curvature @ way) >= bend - 0.05 * abs(bend) - 1.0
    assert np.all(np.linalg.eigvalsh(model.curvature) > 0.0)
