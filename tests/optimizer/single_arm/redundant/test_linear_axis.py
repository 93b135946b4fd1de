"""Arms on a linear axis: as good as a brute force, whatever its travel, its steps and the region of the base."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import range_weights
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.box import reach_windows
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import Settings
from tests.support.given.arms import make_arm, region
from tests.support.given.linear_axis import on_linear_axis
from tests.support.given.tasks import Possible, possible
from tests.support.oracles.brute_linear_axis import cheapest

SEARCH = Settings(certificate=None)
TRAVEL = (-1.0, 1.5)


def drawn(seed: int, name: str = "ur10e", travel: tuple[float, float] = TRAVEL, free: float = 0.0) -> Possible:
    """A possible task; the base may stand ``free`` m off, at any yaw if at all."""
    robot = on_linear_axis(name, travel)
    half = (free, free, 0.0, np.pi if free else 0.0)
    return possible(robot, np.random.default_rng(seed), poses=5, step=0.2, half=half)


def steps_of(layout: Layout) -> Floats:
    """(n,) longest step of each joint."""
    steps: Floats = np.max(np.abs(np.diff(layout.placements[0].joints, axis=0)), axis=0)
    return steps


@pytest.mark.parametrize("name", ["ur10e", "puma560"])
@pytest.mark.parametrize("seed", [2, 4])
def test_no_worse_than_every_place_of_the_carriage_from_where_it_stands(name: str, seed: int) -> None:
    task = drawn(seed, name)
    places = np.arange(TRAVEL[0], TRAVEL[1], 0.02)
    brute, _ = cheapest(task.cell, task.arm, task.arm.base.bounds[None, :, 0], places)
    found = optimize(task.cell, SEARCH)
    assert found.objective is not None
    assert found.objective <= brute * (1.0 + 1e-9)
    assert found.objective >= 0.9 * brute


def test_paths_over_the_carriage_are_taken_where_seeds_miss_them() -> None:
    """The best of the other seeds costs 155.6 here."""
    task = drawn(15, "puma560", (0.0, 4.0))
    found = optimize(task.cell, SEARCH)
    assert found.objective == pytest.approx(101.686, abs=1e-2)
    brute, _ = cheapest(task.cell, task.arm, task.arm.base.bounds[None, :, 0], np.arange(0.0, 4.0, 0.02))
    assert found.objective is not None
    assert found.objective <= brute


def test_no_worse_than_a_grid_of_bases() -> None:
    task = drawn(6, free=0.3)
    low, high = task.arm.base.bounds[:, 0], task.arm.base.bounds[:, 1]
    axes = [np.linspace(low[i], high[i], count) for i, count in enumerate((4, 4, 1))] + [np.linspace(-3.1, 3.1, 9)]
    bases = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 4)
    brute, _ = cheapest(task.cell, task.arm, bases, np.linspace(*TRAVEL, 26))
    found = optimize(task.cell, SEARCH)
    assert found.objective is not None
    assert found.objective <= brute


def test_a_long_travel_is_no_turn() -> None:
    """Values of a linear axis more than 2π apart are different places."""
    task = drawn(3, travel=(0.0, 12.0))
    layout = optimize(task.cell, SEARCH)
    assert layout.outcome is Outcome.FEASIBLE
    joints = layout.placements[0].joints
    assert np.all(joints >= task.arm.lower - 1e-9)
    assert np.all(joints <= task.arm.upper + 1e-9)
    assert layout.verification is not None
    assert layout.verification.max_position_error < 1e-8


def test_a_base_that_is_free_along_the_axis_is_no_trouble() -> None:
    """The base and the carriage can undo each other: the reference decides, and the axis may even weigh nothing."""
    task = drawn(8, free=0.5)
    layout = optimize(task.cell, SEARCH)
    assert layout.outcome is Outcome.FEASIBLE
    light = replace(task.arm, weights=np.where(task.arm.robot.prismatic, 0.0, task.arm.weights))
    free = optimize(replace(task.cell, arms=(light,), max_prismatic_step=0.3), SEARCH)
    assert free.outcome is Outcome.FEASIBLE
    assert layout.objective is not None
    assert free.objective is not None
    assert free.objective <= layout.objective * (1.0 + 1e-6)


def test_steps_are_kept_by_kind() -> None:
    task = drawn(1)
    free = optimize(task.cell, SEARCH)
    turn, shift = float(np.max(steps_of(free)[1:])), float(steps_of(free)[0])
    assert shift > 0.02
    slow = optimize(replace(task.cell, max_prismatic_step=0.5 * shift), SEARCH)
    assert slow.outcome is Outcome.FEASIBLE
    assert steps_of(slow)[0] <= 0.5 * shift + 1e-6
    assert slow.verification is not None
    assert slow.verification.max_prismatic_step == pytest.approx(float(steps_of(slow)[0]), abs=1e-12)
    assert slow.objective is not None
    assert free.objective is not None
    assert slow.objective > free.objective
    smooth = optimize(replace(task.cell, max_joint_step=0.97 * turn), SEARCH)
    assert smooth.verification is not None
    assert smooth.verification.max_joint_step <= 0.97 * turn + 1e-6


def test_weights_follow_the_ranges_and_margins_their_units() -> None:
    task = drawn(1)
    ranges = task.arm.upper - task.arm.lower
    assert range_weights(task.arm.lower, task.arm.upper) == pytest.approx((np.max(ranges) / ranges) ** 2)
    placement = optimize(task.cell, SEARCH).placements[0]
    joints = placement.joints
    margins = np.minimum(np.min(joints, axis=0) - task.arm.lower, task.arm.upper - np.max(joints, axis=0))
    assert placement.joint_margins == pytest.approx(margins)
    assert placement.minimum_margin == pytest.approx(np.min(margins[1:]))
    assert [kind.unit for kind in placement.joint_kinds] == ["m", *6 * ["rad"]]


@pytest.mark.parametrize("tilted", [False, True])
def test_no_base_that_reaches_is_outside_of_the_windows(tilted: bool) -> None:
    """Limits in force count, not the robot's own; the carriage climbs here."""
    robot = on_linear_axis("ur10e", axis=(1.0, 0.4, 0.6))
    mount = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]) if tilted else np.eye(3)
    upper = robot.upper.copy()
    upper[0] = 4.0
    rng = np.random.default_rng(5)
    task = possible(robot, rng, poses=3, mount=mount, upper=upper)
    arm = make_arm(robot, base=region(), mount=mount, upper=upper)
    for _ in range(300):
        q = rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, 4.0))
        q[0] = rng.choice([arm.lower[0], arm.upper[0]])
        flange = task.cell.flange_targets(task.arm)[0]
        yaw = rng.uniform(-np.pi, np.pi)
        turned = arm.base_in_world(np.zeros(3), yaw) @ flange_poses(robot, q)[0]
        base = flange[:3, 3] - turned[:3, 3]
        window = reach_windows(task.cell, replace(task.arm, upper=arm.upper))[0]
        assert np.all(base >= window[:, 0])
        assert np.all(base <= window[:, 1])
