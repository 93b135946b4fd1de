"""Random tasks, possible by construction, against brute force that shares nothing with the optimizer."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_from_rpy, rotation_x, rotation_z, transform
from duocell.optimizer.optimize import optimize
from tests.support.given.tasks import possible
from tests.support.oracles.answers import assert_ended, assert_sound
from tests.support.oracles.brute import USELESS, brute_force
from tests.support.present import present

TOOL = transform(rotation_from_rpy((0.3, -0.5, 0.2)), [0.05, 0.0, 0.12])
GRASP = transform(rotation_z(2.0), [0.1, -0.2, 0.0])
FREE, SOME, FIXED = np.pi, 0.4, 0.0

CASES = [
    # robot, seed, poses, half widths of the region (x, y, z, yaw), how tight the limits are
    ("puma560", 1, 6, (0.8, 0.8, 0.0, FREE), None),
    ("puma560", 2, 4, (0.4, 0.4, 0.0, SOME), 0.1),
    ("ur5e", 3, 5, (0.6, 0.6, 0.0, FREE), None),
    ("ur10e", 4, 5, (1.0, 1.0, 0.0, FIXED), None),
    ("ur3e", 5, 5, (0.4, 0.4, 0.0, FREE), None),
    ("kr6_r900", 6, 5, (0.8, 0.8, 0.0, FREE), None),
    ("irb120", 7, 4, (0.5, 0.5, 0.0, SOME), None),
    ("lrmate200id", 8, 4, (0.6, 0.6, 0.0, FREE), 0.3),
    ("rx160", 9, 5, (1.5, 1.5, 0.0, FREE), None),
    ("gp8", 10, 4, (0.5, 0.0, 0.0, FIXED), None),
    ("j2s6s300", 11, 4, (0.4, 0.4, 0.0, SOME), None),
    ("vs060", 12, 4, (2.0, 2.0, 0.0, FREE), 0.02),
    ("puma560_ssik", 13, 3, (0.3, 0.3, 0.3, FREE), None),
    ("standardbots_core", 14, 3, (0.0, 0.4, 0.3, SOME), None),
]


@pytest.mark.parametrize(("robot", "seed", "poses", "half", "tight"), CASES)
def test_closed_form_arms_are_as_good_as_brute_force(
    robot: str, seed: int, poses: int, half: tuple[float, float, float, float], tight: float | None
) -> None:
    task = possible(
        robot, np.random.default_rng(seed), poses=poses, half=half, tight=tight, tool=TOOL, grasp=GRASP, step=0.15
    )
    x, y, z = ((5 if half[2] else 11) if side else 1 for side in half[:3])
    best = brute_force(task.cell, task.arm, (x, y, z), task.position)
    assert best < USELESS
    layout = optimize(task.cell)
    assert_ended(layout)
    assert_sound(task.cell, layout)
    assert present(layout.objective) <= 1.001 * best


@pytest.mark.parametrize(("robot", "seed"), [("fanuc_crx10ia", 1), ("xarm6", 2), ("m0609", 3)])
def test_general_six_joint_arms_are_as_good_as_brute_force(robot: str, seed: int) -> None:
    task = possible(robot, np.random.default_rng(seed), poses=3, half=(0.3, 0.3, 0.0, FREE), step=0.1)
    best = brute_force(task.cell, task.arm, (7, 7, 1), task.position)
    layout = optimize(task.cell)
    assert_sound(task.cell, layout)
    assert present(layout.objective) <= 1.001 * best


@pytest.mark.parametrize(("robot", "mount"), [("ur5e", rotation_x(np.pi)), ("puma560", rotation_x(np.pi / 2))])
def test_arms_on_ceilings_and_walls_are_as_good_as_brute_force(robot: str, mount: Floats) -> None:
    task = possible(robot, np.random.default_rng(21), poses=4, half=(0.5, 0.5, 0.0, FREE), mount=mount)
    best = brute_force(task.cell, task.arm, (11, 11, 1), task.position)
    layout = optimize(task.cell)
    assert_sound(task.cell, layout)
    assert present(layout.objective) <= 1.001 * best


@pytest.mark.parametrize("robot", ["iiwa14", "franka_panda", "gen3", "yumi_left"])
def test_redundant_arms_are_better_than_the_witness_by_its_null_space(robot: str) -> None:
    """No brute force here; but the witness is any posture, and moving the elbow alone betters it."""
    task = possible(robot, np.random.default_rng(31), poses=3, half=(0.2, 0.2, 0.0, FREE), step=0.08)
    layout = optimize(task.cell)
    assert_sound(task.cell, layout)
    witness = float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2))
    assert present(layout.objective) < 0.9 * witness
