"""Every arm of the catalogue gets a sound layout, and the named ones along a straight line."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.pose import inverse, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import line
from duocell.models.kinematics.kinematics import flange_poses, reach
from duocell.optimizer.optimize import optimize
from tests.support.given.arms import make_arm, region
from tests.support.given.tasks import possible
from tests.support.oracles.answers import assert_ended, assert_sound
from tests.support.present import present

LINE = (
    "puma560", "ur5e", "ur10e", "irb120", "lrmate200id", "kr6_r900", "rx160", "gp8", "iiwa14", "franka_panda",
)  # fmt: skip


def along_a_line(names: tuple[str, ...], count: int = 10) -> Cell:
    """Arms that carry a part along a straight line, a quarter of the shortest reach long."""
    length = 0.25 * min(reach(catalogue.robot(name)) for name in names)
    half = transform(np.eye(3), [0.0, 0.5 * length, 0.0])
    task = line(inverse(half), half, count)
    arms = []
    for k, name in enumerate(names):
        arm = make_arm(name)
        home = flange_poses(arm.robot, arm.reference)[0]
        base = transform(rotation_z(2.0 * k), np.zeros(3))
        base[:3, 3] = -(base @ home)[:3, 3] + [0.0, 0.0, 0.2 * k]
        size = 0.3 * reach(arm.robot)
        x, y, z = base[:3, 3]
        place = region((x - size, x + size), (y - size, y + size), z)
        arms.append(make_arm(name, f"arm{k}", place, grasp=base @ home))
    return Cell(task, tuple(arms))


@pytest.mark.parametrize("name", LINE)
def test_a_straight_line(name: str) -> None:
    cell = along_a_line((name,))
    layout = optimize(cell)
    assert_ended(layout)
    assert_sound(cell, layout)


def test_a_straight_line_with_a_mixed_pair() -> None:
    cell = along_a_line(("ur10e", "iiwa14"))
    layout = optimize(cell)
    assert_ended(layout)
    assert_sound(cell, layout)
    assert [placement.posture is None for placement in layout.placements] == [False, True]


@pytest.mark.parametrize("name", catalogue.names())
def test_every_arm(name: str) -> None:
    """A task built from joint values of its own, a base that may move and turn a little."""
    task = possible(name, np.random.default_rng(1), poses=3, step=0.08, half=(0.1, 0.0, 0.0, 0.3))
    layout = optimize(task.cell)
    assert_ended(layout)
    assert_sound(task.cell, layout)
    witness = float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2))
    assert present(layout.objective) <= witness + 1e-9
