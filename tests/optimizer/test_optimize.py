"""The whole way: cells in, sound layouts out; what is fixed stays fixed, what is asked for is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from duocell.models.base.pose import inverse, rotation_x, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import posture_of
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.posture import ALL_SIGNS, Posture, name_signs
from duocell.models.robot.robot import Robot
from duocell.optimizer.optimize import optimize
from tests.support.given.arms import form_of, general_six, make_arm, oblique_wrist, puma_by_table, region, skew_robot
from tests.support.given.tasks import Possible, possible, with_arm
from tests.support.oracles.answers import assert_sound, reached, solved
from tests.support.present import present

ROOT = Path(__file__).resolve().parents[2]
FREE = np.pi


# --- what may move ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["puma560", "ur10e", "yumi_left"])
def test_every_coordinate_of_the_base_can_be_fixed(name: str) -> None:
    """The witness's own place; more freedom never costs."""
    task = possible(name, np.random.default_rng(0), poses=4, step=0.08)
    x, y, z, yaw = *task.position, task.yaw
    costs = []
    for place in (
        region(x, y, z, yaw),
        region(x, y, z, (yaw - 0.2, yaw + 0.2)),
        region((x - 0.1, x + 0.1), y, z, (yaw - 0.2, yaw + 0.2)),
        region((x - 0.1, x + 0.1), (y - 0.1, y + 0.1), (z - 0.1, z + 0.1), (yaw - 0.2, yaw + 0.2)),
    ):
        layout = solved(with_arm(task, base=place))
        (placement,) = layout.placements
        bounds = place.bounds
        fixed = bounds[:, 0] == bounds[:, 1]
        assert np.array([*placement.position, placement.yaw])[fixed] == pytest.approx(bounds[fixed, 0], abs=1e-12)
        costs.append(present(layout.objective))
    assert costs[0] <= float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2)) + 1e-6
    for less, more in pairwise(costs):
        assert more <= less * (1.0 + 1e-6)


def test_a_yaw_interval_may_lie_in_any_turn() -> None:
    task = possible("ur5e", np.random.default_rng(1), half=(0.3, 0.3, 0.0, 0.3))
    (first,) = solved(task.cell).placements
    for turn in (-2, 1):
        yaw = replace(
            task.arm.base.yaw,
            low=task.arm.base.yaw.low + turn * 2 * np.pi,
            high=task.arm.base.yaw.high + turn * 2 * np.pi,
        )
        (placement,) = solved(with_arm(task, base=replace(task.arm.base, yaw=yaw))).placements
        assert placement.objective == pytest.approx(first.objective, rel=1e-6)
        assert placement.yaw == pytest.approx(first.yaw + turn * 2 * np.pi, abs=1e-3)


def turned_world(task: Possible, angle: float) -> Cell:
    """The same cell seen from a world turned by ``angle`` about its vertical; the base may stand about the origin."""
    turn = transform(rotation_z(angle), np.zeros(3))
    return replace(task.cell, task=Task(turn @ task.cell.task.poses))


@pytest.mark.parametrize("gap", [0.0, 8e-5, 2e-4])
def test_the_reported_yaw_is_the_one_at_which_the_poses_are_reached(gap: float) -> None:
    """Also where the interval leaves a sliver of the turn out and the best yaw lies in it."""
    task = possible("puma560", np.random.default_rng(2), half=(0.0, 0.0, 0.0, FREE))
    task = replace(
        task, cell=replace(task.cell, task=Task(transform(np.eye(3), -task.position) @ task.cell.task.poses))
    )
    free = with_arm(task, base=region(0, 0, 0, (-FREE, FREE)))
    best = optimize(free).placements[0].yaw
    cell = turned_world(replace(task, cell=free), np.pi - best)  # now the best yaw is π
    half = np.pi - gap / 2.0
    cell = replace(cell, arms=(replace(cell.arms[0], base=region(0, 0, 0, (-half, half))),))
    layout = solved(cell)
    assert abs(layout.placements[0].yaw) <= half
    assert abs(layout.placements[0].yaw) == pytest.approx(np.pi, abs=1e-3)


@pytest.mark.parametrize("name", ["puma560", "kr6_r900", "iiwa14"])
def test_a_turned_and_moved_world_has_the_same_layout_turned_and_moved(name: str) -> None:
    task = possible(name, np.random.default_rng(3), poses=4, half=(0.5, 0.5, 0.0, FREE), step=0.08)
    wide = region((-3, 3), (-3, 3), task.position[2])
    (here,) = solved(with_arm(task, base=wide)).placements
    motion = transform(rotation_z(1.0), [0.3, -0.4, 0.2])
    cell = replace(
        task.cell,
        task=Task(motion @ task.cell.task.poses),
        arms=(replace(task.arm, base=region((-4, 4), (-4, 4), task.position[2] + 0.2)),),
    )
    (there,) = solved(cell).placements
    assert there.objective == pytest.approx(here.objective, rel=1e-3 if name == "iiwa14" else 1e-6)
    if name != "iiwa14":
        assert (motion[:3, :3] @ here.position + motion[:3, 3]) == pytest.approx(there.position, abs=1e-3)


@pytest.mark.parametrize(("name", "scale"), [("puma560", 1e-4), ("puma560", 1e4), ("iiwa14", 1e-4), ("gen3", 1e4)])
def test_the_size_of_the_weights_does_not_matter(name: str, scale: float) -> None:
    task = possible(name, np.random.default_rng(3), half=(0.4, 0.4, 0.0, FREE))
    plain = optimize(task.cell).objective
    layout = solved(with_arm(task, weights=scale * task.arm.weights))
    assert present(layout.objective) / scale == pytest.approx(plain, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "seed", "poses", "half", "scale"),
    [("puma560", 186531946, 30, 0.3, 1e3), ("puma560_ssik", 907020965, 6, 1.0, 1e-3)],
)
def test_nor_does_it_where_the_best_base_is_close_to_the_limits(
    name: str, seed: int, poses: int, half: float, scale: float
) -> None:
    """What the screening charges for a violation must be measured against the cost."""
    task = possible(name, np.random.default_rng(seed), poses=poses, step=0.9 / poses, half=(half, half, 0.0, FREE))
    plain = optimize(task.cell).objective
    scaled = present(optimize(with_arm(task, weights=scale * task.arm.weights)).objective) / scale
    assert scaled == pytest.approx(plain, rel=1e-3)


def test_weights_of_zero_leave_any_usable_base() -> None:
    task = possible("ur5e", np.random.default_rng(4))
    assert solved(with_arm(task, weights=np.zeros(6))).objective == 0.0


def test_a_reference_that_is_reached_costs_nothing() -> None:
    """A part at rest, and a base that lets the arm take its reference exactly."""
    arm = make_arm("ur5e", base=region((-2, 2), (-2, 2), (-1, 1)))
    pose = transform(rotation_z(0.3), [0.4, 0.2, 0.1]) @ flange_poses(arm.robot, arm.reference)
    layout = solved(Cell(Task(np.repeat(pose, 3, axis=0)), (arm,)))
    assert present(layout.objective) < 1e-9
    assert layout.placements[0].position == pytest.approx([0.4, 0.2, 0.1], abs=1e-5)
    assert layout.placements[0].yaw == pytest.approx(0.3, abs=1e-5)


# --- what is asked for ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["puma560", "ur5e"])
def test_postures_that_are_asked_for_are_kept(name: str) -> None:
    task = possible(name, np.random.default_rng(6), half=(0.8, 0.8, 0.0, FREE))
    best = present(solved(task.cell).objective)
    found = []
    for signs in ALL_SIGNS:
        cell = with_arm(task, posture=Posture(*signs))
        layout = optimize(cell)
        if layout.usable:
            assert_sound(cell, layout)
            assert layout.placements[0].posture == name_signs(signs)
            found.append(present(layout.objective))
    assert len(found) >= 3
    assert min(found) == pytest.approx(best, rel=1e-6)
    for posture in (Posture(shoulder=1), Posture(elbow=-1), Posture(wrist=1)):
        layout = optimize(with_arm(task, posture=posture))
        assert present(layout.objective) >= best * (1.0 - 1e-9)


def test_an_arm_with_a_tilted_first_axis_keeps_its_posture_too() -> None:
    """A closed form in its own base frame, whose axis 1 leans: the search is another, the rule is the same."""
    robot = make_arm("puma560").robot
    placements = robot.joint_placements.copy()
    placements[0] = transform(rotation_x(0.3), np.zeros(3)) @ placements[0]
    leaning = replace(robot, name="leaning", joint_placements=placements)
    task = possible(leaning, np.random.default_rng(7), poses=4, half=(0.3, 0.3, 0.0, 1.0))
    solved(task.cell)
    signs = posture_of(form_of(leaning), task.joints[0])
    layout = solved(with_arm(task, posture=Posture(*signs)))
    assert layout.placements[0].posture == name_signs(signs)


def test_conditioning_that_is_asked_for_is_kept_and_costs() -> None:
    task = possible("puma560", np.random.default_rng(8), half=(0.6, 0.6, 0.0, FREE))
    plain = with_arm(task, reference=0.5 * (task.arm.lower + task.arm.upper))
    free = solved(plain)
    before = free.placements[0].minimum_conditioning
    asked = solved(replace(plain, arms=(replace(plain.arms[0], min_conditioning=before + 0.02),)))
    assert asked.placements[0].minimum_conditioning >= before + 0.02 - 1e-9
    assert present(asked.objective) > present(free.objective)


def test_a_straight_elbow_is_avoided_where_conditioning_is_asked_for() -> None:
    """The mid-range reference of a UR10e has a straight elbow; margins do not show it, conditioning does."""
    arm = make_arm("ur10e", base=region((-1.5, 1.5), (-1.5, 1.5)), reference=np.zeros(6))
    poses = transform(rotation_x(np.pi), np.array([[0.7, y, 0.5] for y in np.linspace(-0.2, 0.2, 5)]))
    loose = solved(Cell(Task(poses), (arm,)))
    held = solved(Cell(Task(poses), (replace(arm, min_conditioning=0.15),)))
    assert loose.placements[0].minimum_margin > 1.0
    assert loose.placements[0].minimum_conditioning < 0.15 <= held.placements[0].minimum_conditioning + 1e-9


# --- one, two, three arms ---------------------------------------------------------------------------------------------


def holding(names: list[str], seed: int, poses: int = 5) -> Cell:
    """Arms that hold one object which moves along a short line; each can, from around a base of its own."""
    rng = np.random.default_rng(seed)
    way = np.linspace(-0.08, 0.08, poses)
    task = Task(transform(rotation_z(0.2), np.array([[s, 0.3 * s, 0.6] for s in way])))
    arms = []
    for k, name in enumerate(names):
        arm = make_arm(name, f"arm{k}")
        home = flange_poses(arm.robot, arm.reference)[0]
        base = transform(rotation_z(rng.uniform(-3, 3)), [*rng.uniform(-1, 1, 2), 0.0])
        grasp = inverse(task.poses[poses // 2]) @ base @ home
        x, y, z = base[:3, 3]
        arms.append(replace(arm, grasp=grasp, base=region((x - 0.4, x + 0.4), (y - 0.4, y + 0.4), z)))
    return Cell(task, tuple(arms))


@pytest.mark.parametrize("names", [["ur5e"], ["puma560", "rx160"], ["ur10e", "iiwa14"], ["gp8", "ur3e", "irb120"]])
def test_any_number_of_arms_holds_the_object(names: list[str]) -> None:
    cell = holding(names, len(names))
    layout = solved(cell)
    assert len(layout.placements) == len(names)
    for arm, placement in zip(cell.arms, layout.placements, strict=True):
        alone = optimize(replace(cell, arms=(arm,)))
        assert placement.objective == alone.objective
        assert np.array_equal(placement.joints, alone.placements[0].joints)


def test_progress_is_told_in_order() -> None:
    cell = holding(["ur5e", "puma560"], 2)
    told: list[tuple[str, float]] = []
    optimize(cell, progress=lambda what, fraction: told.append((what, fraction)))
    assert [fraction for _, fraction in told] == sorted(fraction for _, fraction in told)
    assert all(0.0 <= fraction <= 1.0 for _, fraction in told)
    assert {"arm0", "arm1"} <= {word for what, _ in told for word in what.split()}


# --- kinds of arms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [puma_by_table, oblique_wrist, skew_robot, general_six])
def test_arms_sent_as_tables(make: Callable[[], Robot]) -> None:
    robot = make()
    task = possible(robot, np.random.default_rng(9), poses=4, half=(0.4, 0.4, 0.0, FREE))
    layout = solved(task.cell)
    witness = float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2))
    assert present(layout.objective) <= witness * (1.0 + 1e-9)


def test_the_sources_arm_by_table_and_by_name_stands_in_the_same_place() -> None:
    task = possible("puma560", np.random.default_rng(10), half=(0.5, 0.5, 0.0, FREE))
    named = solved(task.cell)
    table = solved(with_arm(task, robot=puma_by_table()))
    assert table.objective == pytest.approx(named.objective, rel=1e-9)
    assert table.placements[0].position == pytest.approx(named.placements[0].position, abs=1e-6)


@pytest.mark.parametrize(("name", "endless"), [("gen3", [0, 2, 4, 6]), ("ur3e", [5]), ("j2s6s300", [0, 3, 5])])
def test_endless_joints_have_no_margin_no_weight_and_no_jumps(name: str, endless: list[int]) -> None:
    task = possible(name, np.random.default_rng(11), poses=4, half=(0.2, 0.2, 0.0, FREE), step=0.08)
    (placement,) = solved(task.cell).placements
    assert np.flatnonzero(np.isinf(placement.joint_margins)).tolist() == endless
    assert np.all(task.arm.weights[endless] == 0.0)
    assert np.abs(np.diff(placement.joints, axis=0)).max() < np.pi / 2
    assert np.isfinite(placement.minimum_margin)


def test_a_tool_and_a_grasp_are_taken_into_account() -> None:
    """A longer tool brings the base away from the part: the same layout as with the part moved."""
    tool = transform(rotation_x(0.3), [0.0, 0.05, 0.2])
    task = possible("ur5e", np.random.default_rng(15), tool=tool, grasp=transform(np.eye(3), [0.1, 0, 0]))
    (placement,) = solved(task.cell).placements
    for pose, q in zip(task.cell.task.poses, placement.joints, strict=True):
        tcp = reached(task.arm, placement.position, placement.yaw, q)
        assert np.abs(tcp - pose @ task.arm.grasp).max() < 1e-6
    bare = replace(task.arm, tool=np.eye(4), grasp=task.arm.grasp @ inverse(tool))
    same = solved(replace(task.cell, arms=(bare,)))
    assert same.objective == pytest.approx(placement.objective, rel=1e-9)
