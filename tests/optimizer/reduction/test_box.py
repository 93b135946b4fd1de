"""Windows of the base against random configurations; points spread over a box."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_from_rpy, rotation_x, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.dh import robot_from_dh
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Arm
from duocell.optimizer.reduction.box import reach_windows, search_box, spread
from tests.support.given.arms import make_arm, oblique_wrist, region, skew_rows

TOOL = transform(rotation_from_rpy((0.5, 0.2, -0.8)), [0.1, 0.0, 0.2])
GRASP = transform(rotation_from_rpy((-0.4, 1.0, 0.3)), [0.0, 0.3, -0.1])
EVERYWHERE = region((-50, 50), (-50, 50), (-50, 50))


def posed(arm: Arm, position: Floats, yaw: float, joints: Floats) -> Cell:
    """The cell in which the arm, standing at a place, takes all joint values (m, n)."""
    flange = transform(arm.mount @ rotation_z(yaw), position) @ flange_poses(arm.robot, joints)
    return Cell(Task(flange @ arm.tool @ inverse(arm.grasp)), (arm,))


def holds(arm: Arm, seed: int, count: int = 300) -> None:
    rng = np.random.default_rng(seed)
    position, yaw = rng.uniform(-5.0, 5.0, 3), rng.uniform(-np.pi, np.pi)
    cell = posed(arm, position, yaw, rng.uniform(-np.pi, np.pi, (count, arm.dof)))
    windows = reach_windows(cell, arm)
    assert windows.shape == (count, 3, 2)
    assert np.all(windows[:, :, 0] <= position)
    assert np.all(position <= windows[:, :, 1])
    box = search_box(cell, arm)
    assert np.all(box[:, 0] <= position)
    assert np.all(position <= box[:, 1])


@pytest.mark.parametrize("name", catalogue.names())
def test_the_base_is_inside_every_window_whatever_the_joints(name: str) -> None:
    holds(make_arm(name, base=EVERYWHERE, tool=TOOL, grasp=GRASP), 1)


@pytest.mark.parametrize("name", ["puma560", "kr6_r900", "iiwa14", "yumi_left"])
@pytest.mark.parametrize("tilt", [0.7, np.pi / 2, np.pi])
def test_the_base_is_inside_every_window_of_a_mounted_arm(name: str, tilt: float) -> None:
    holds(make_arm(name, base=EVERYWHERE, tool=TOOL, mount=rotation_z(0.4) @ rotation_x(tilt)), 2)


def test_an_axis_2_that_is_not_level_widens_the_window() -> None:
    for angle in (0.5, 1.0, 2.2):
        holds(make_arm(robot_from_dh("skew", skew_rows(angle)), base=EVERYWHERE), 3, 3000)
    holds(make_arm(oblique_wrist(), base=EVERYWHERE), 4)


def test_windows_are_not_much_larger_than_the_reach() -> None:
    """The stretched arm touches them: soundness is not bought with the whole plane."""
    arm = make_arm("ur10e", base=EVERYWHERE)
    straight = np.array([[0.0, -np.pi / 2 + 1.5708, 0.0, 0.0, 0.0, 0.0]])
    cell = posed(arm, np.zeros(3), 0.0, straight)
    half = 0.5 * (reach_windows(cell, arm)[0, :, 1] - reach_windows(cell, arm)[0, :, 0])
    assert np.all(half < 1.5)
    centre = reach_windows(cell, arm)[0].mean(axis=1)
    assert np.linalg.norm(centre[:2]) > 0.8 * half[0]


def test_the_search_box_is_what_region_and_windows_have_in_common() -> None:
    arm = make_arm("puma560", base=region((-0.2, 3.0), (0.1, 0.1), (-0.5, 0.5)))
    cell = posed(arm, np.array([0.0, 0.1, 0.0]), 0.3, np.random.default_rng(0).uniform(-1.0, 1.0, (5, 6)))
    box, windows = search_box(cell, arm), reach_windows(cell, arm)
    assert box[0, 0] == max(-0.2, windows[:, 0, 0].max())
    assert box[0, 1] == min(3.0, windows[:, 0, 1].min())
    assert box[1].tolist() == [0.1, 0.1]


def test_no_box_is_left_where_two_poses_are_too_far_apart() -> None:
    arm = make_arm("puma560", base=EVERYWHERE)
    cell = posed(arm, np.zeros(3), 0.0, np.zeros((2, 6)))
    poses = cell.task.poses.copy()
    poses[1, 0, 3] += 3.0
    box = search_box(replace(cell, task=Task(poses)), arm)
    assert box[0, 0] > box[0, 1]


SIDES = st.lists(
    st.tuples(st.floats(-5.0, 5.0), st.sampled_from([0.0, 0.5, 2.0])).map(lambda p: (p[0], p[0] + p[1])),
    min_size=1,
    max_size=4,
)


@given(SIDES, st.integers(0, 1000))
def test_spread_points_are_in_the_box_and_fixed_sides_stay(sides: list[tuple[float, float]], seed: int) -> None:
    box = np.array(sides)
    points = spread(box, 16, seed)
    free = box[:, 1] > box[:, 0]
    assert points.shape == (16 if free.any() else 1, len(box))
    assert np.all(points >= box[:, 0])
    assert np.all(points <= box[:, 1])
    assert np.array_equal(points, spread(box, 16, seed))
    many = spread(box, 256, seed)
    for i in np.flatnonzero(free):  # sixteen points in each sixteenth of every side, more or less
        part = np.minimum(16.0 * (many[:, i] - box[i, 0]) / (box[i, 1] - box[i, 0]), 15.0).astype(int)
        assert np.bincount(part, minlength=16).min() >= 8


def test_other_seeds_give_other_points() -> None:
    box = np.array([[0.0, 1.0], [0.0, 1.0]])
    assert not np.array_equal(spread(box, 8, 0), spread(box, 8, 1))


def test_spread_returns_arrays_of_its_own() -> None:
    box = np.array([[0.0, 1.0], [0.0, 1.0]])
    spread(box, 8, 0)[:] = 99.0
    assert spread(box, 8, 0).max() < 1.0
