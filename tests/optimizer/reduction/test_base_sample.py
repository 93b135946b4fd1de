"""Samples of bases: even, inside the box, and turned and moved with the task."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.optimizer.reduction.base_sample import BoxFrame
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.reduced import reduced_problem
from tests.support.given.arms import region
from tests.support.given.tasks import possible
from tests.support.present import present


def turned(cell: Cell, quarter: int, shift: Floats) -> Cell:
    """The cell with its world turned by quarter turns and moved."""
    whole = transform(rotation_z(quarter * np.pi / 2), shift)
    arm = cell.arms[0]
    corners = np.array([[arm.base.x.low, arm.base.y.low, 0.0], [arm.base.x.high, arm.base.y.high, 0.0]])
    ends = np.sort(corners @ whole[:3, :3].T, axis=0) + shift
    yaw = (
        arm.base.yaw
        if arm.base.yaw_free
        else (arm.base.yaw.low + quarter * np.pi / 2, arm.base.yaw.high + quarter * np.pi / 2)
    )
    base = region(
        ends[:, 0], ends[:, 1], arm.base.bounds[2] + shift[2] if not arm.base.z.fixed else arm.base.z.low, yaw
    )
    return replace(cell, task=Task(whole @ cell.task.poses), arms=(replace(arm, base=base),))


def frame(cell: Cell) -> BoxFrame:
    problem = present(reduced_problem(cell, cell.arms[0]))
    return BoxFrame.of(problem, search_box(cell, cell.arms[0]))


@pytest.mark.parametrize("half", [(0.4, 0.2, 0.0, np.pi), (0.4, 0.2, 0.1, 0.5), (0.4, 0.0, 0.0, np.pi)])
@pytest.mark.parametrize("quarter", [1, 2, 3])
def test_a_sample_turns_with_the_world(half: tuple[float, float, float, float], quarter: int) -> None:
    cell = possible("puma560", np.random.default_rng(3), half=half).cell
    shift = np.array([8.0, -5.0, 0.0])
    here, there = frame(cell), frame(turned(cell, quarter, shift))
    expected = here.sample(128, 0) @ rotation_z(quarter * np.pi / 2).T + shift
    assert there.sample(128, 0) == pytest.approx(expected, abs=1e-9)


def test_a_sample_is_in_the_box_and_at_its_corners() -> None:
    cell = possible("ur10e", np.random.default_rng(4)).cell
    one = frame(cell)
    points = one.sample(256, 0)
    assert points.shape == (256, 3)
    assert np.all((points >= one.box[:, 0]) & (points <= one.box[:, 1]))
    for x in one.box[0]:
        for y in one.box[1]:
            assert np.min(np.linalg.norm(points[:, :2] - [x, y], axis=1)) < 1e-12
    inner = points[
        np.all((points > one.box[:, 0]) & (points < one.box[:, 1]) | (one.box[:, 0] == one.box[:, 1]), axis=1)
    ]
    part = ((inner[:, :2] - one.box[:2, 0]) / (one.box[:2, 1] - one.box[:2, 0]) * 4.0).astype(int)
    assert np.bincount(4 * part[:, 0] + part[:, 1], minlength=16).min() >= 8
