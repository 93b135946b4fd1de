"""What poses ask of an arm and leave open: against matrices multiplied by hand, and against differences."""

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_from_rpy, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval
from duocell.models.robot.freedom import Frame, Freedom

M = 5


def poses(seed: int, count: int = M) -> Floats:
    rng = np.random.default_rng(seed)
    return transform(rotation_from_rpy(rng.uniform(-1.0, 1.0, (count, 3))), rng.uniform(-1.0, 1.0, (count, 3)))


def freedom(ranges: dict[int, tuple[float, float]], frame: Frame, axes: Floats, cone: float = 0.0) -> Freedom:
    lower, upper = np.zeros((M, 8)), np.zeros((M, 8))
    for index, (low, high) in ranges.items():
        lower[:, index], upper[:, index] = low, high
    turned = np.broadcast_to(axes, (M, 3, 3))
    return Freedom(lower, upper, np.full(M, cone), turned, np.full(M, frame), np.full(8, np.inf))


def cell_of(given: Freedom | None) -> tuple[Cell, Arm]:
    robot = catalogue.robot("puma560")
    zero = Interval(0.0, 0.0)
    arm = Arm(
        name="a",
        robot=robot,
        tool=poses(2, 1)[0],
        grasp=poses(3, 1)[0],
        base=BaseRegion(zero, zero, zero, FREE_YAW),
        lower=robot.lower,
        upper=robot.upper,
        reference=robot.reference,
        weights=np.ones(6),
        freedom=given,
    )
    return Cell(Task(poses(1)), (arm,)), arm


def test_without_a_freedom_a_pose_is_six_equations() -> None:
    cell, arm = cell_of(None)
    asked = cell.freedom(arm)
    assert asked.exact
    assert (asked.equations, asked.count, asked.names) == (6, 0, ())
    assert [asked.nullspace(dof) for dof in (6, 7)] == [0, 1]
    assert np.array_equal(asked.targets(), cell.flange_targets(arm))
    assert np.array_equal(cell.flange_targets(arm), cell.task.poses @ arm.grasp @ inverse(arm.tool))


@pytest.mark.parametrize("frame", list(Frame))
def test_displacements_are_in_the_frame_that_is_named(frame: Frame) -> None:
    axes = rotation_from_rpy([0.3, -0.4, 0.9])
    cell, arm = cell_of(freedom({0: (-0.1, 0.1), 7: (-3.0, 3.0)}, frame, axes))
    asked = cell.freedom(arm)
    assert (asked.names, asked.nullspace(6), asked.exact) == (("x", "turn_z"), 2, False)
    values = np.random.default_rng(4).uniform(-0.1, 0.1, (M, 2))
    turned = transform(axes, np.zeros(3))
    for j, (x, angle) in enumerate(values):
        moved = turned @ transform(rotation_z(angle), np.array([x, 0.0, 0.0])) @ inverse(turned)
        pose = cell.task.poses[j]
        hand = pose @ arm.grasp
        if frame is Frame.TOOL:
            hand = hand @ moved
        elif frame is Frame.PART:
            hand = pose @ moved @ arm.grasp
        else:
            place = transform(np.eye(3), hand[:3, 3])
            hand = place @ moved @ inverse(place) @ hand
        assert np.allclose(asked.targets(values)[j], hand @ inverse(arm.tool), atol=1e-14)
        assert np.allclose(pose @ cell.grasps(arm, values)[j], hand, atol=1e-14)


@pytest.mark.parametrize("frame", list(Frame))
def test_twists_are_the_derivatives_of_the_targets(frame: Frame) -> None:
    ranges = dict.fromkeys(range(8), (-0.4, 0.4))
    cell, arm = cell_of(freedom(ranges, frame, rotation_from_rpy([0.3, -0.4, 0.9]), cone=0.4))
    asked = cell.freedom(arm)
    values = np.random.default_rng(5).uniform(-0.3, 0.3, (M, 8))
    twists = asked.twists(values)
    for i in range(8):
        step = np.zeros(8)
        step[i] = 1e-6
        ahead, behind = asked.targets(values + step), asked.targets(values - step)
        spin = (ahead - behind)[:, :3, :3] @ asked.targets(values)[:, :3, :3].swapaxes(1, 2) / 2e-6
        assert np.allclose(twists[:, :3, i], (ahead - behind)[:, :3, 3] / 2e-6, atol=2e-8)
        assert np.allclose(twists[:, 3, i], spin[:, 2, 1], atol=2e-8)
        assert np.allclose(twists[:, 5, i], spin[:, 1, 0], atol=2e-8)


def test_the_nominal_values_are_nearest_to_none_and_given_ones_stay() -> None:
    cell, arm = cell_of(freedom({0: (0.1, 0.2), 1: (0.05, 0.05), 7: (-1.0, 1.0)}, Frame.TOOL, np.eye(3)))
    asked = cell.freedom(arm)
    assert asked.names == ("x", "y", "turn_z")  # y is given and not 0: a program has to know of it
    assert np.allclose(asked.nominal, [0.1, 0.05, 0.0])
    assert np.allclose(asked.targets(asked.nominal), asked.targets())
    values = asked.nominal + np.array([0.05, 0.0, 0.5])
    assert arm.freedom is not None
    fixed = replace(arm, freedom=arm.freedom.fixed(asked.all_values(values)))
    there = cell.freedom(fixed)
    assert there.exact
    assert np.allclose(there.targets(), asked.targets(values))


def test_a_part_of_a_task_keeps_its_own_freedoms() -> None:
    given = freedom({7: (-1.0, 1.0)}, Frame.TOOL, np.eye(3))
    upper = given.upper.copy()
    upper[3:, 7] = 0.25
    cell, arm = cell_of(replace(given, upper=upper))
    part = cell.part(2, 4)
    assert np.allclose(part.freedom(part.arms[0]).upper[:, 0], [1.0, 0.25, 0.25])
    assert np.allclose(part.flange_targets(part.arms[0]), cell.flange_targets(arm)[2:5], atol=1e-15)


def test_ranges_are_held() -> None:
    cell, arm = cell_of(freedom({7: (-1.0, 0.5)}, Frame.TOOL, np.eye(3)))
    excess = cell.freedom(arm).excess(np.array([[-1.2], [0.0], [0.7], [0.5], [-1.0]]))
    assert np.allclose(excess[:, 0], [0.2, -0.5, 0.2, 0.0, 0.0])
    with pytest.raises(ValueError, match="empty"):
        freedom({7: (1.0, -1.0)}, Frame.TOOL, np.eye(3))
