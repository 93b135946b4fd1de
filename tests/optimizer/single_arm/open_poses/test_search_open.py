"""Arms whose poses leave something open: against brute force, and inside what is open by formulas of their own."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bench.judges.roll_grid import best_on_grid
from bench.trials.free_roll import free_roll, free_roll_cell
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_from_rpy, rotation_y, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Distance
from duocell.models.cell.task import line
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.freedom import SIZE, Frame, Freedom
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import CertificateSettings, Settings
from duocell.optimizer.single_arm.search import search_arm

M = 6
QUIET = Settings(certificate=None)
Ranges = dict[int, tuple[float, float]]


def freedom(ranges: Ranges, cone: float = 0.0, frame: Frame = Frame.TOOL, steps: float = np.inf) -> Freedom:
    lower, upper = np.zeros((M, SIZE)), np.zeros((M, SIZE))
    for index, (low, high) in ranges.items():
        lower[:, index], upper[:, index] = low, high
    axes = np.broadcast_to(np.eye(3), (M, 3, 3))
    return Freedom(lower, upper, np.full(M, cone), axes, np.full(M, int(frame)), np.full(SIZE, steps))


def cell_of(given: Freedom | None, name: str = "ur5e", bent: float = 0.6) -> Cell:
    """A line that the hand turns along; with a bent tool the roll is none of the last joint's."""
    made = robot(name)
    start = transform(rotation_from_rpy([np.pi + 0.2, 0.3, 0.5]), np.array([0.4, -0.3, 0.3]))
    end = transform(rotation_from_rpy([np.pi - 0.3, -0.1, 1.6]), np.array([0.5, 0.4, 0.2]))
    arm = Arm(
        name="arm",
        robot=made,
        tool=transform(rotation_y(bent), np.array([0.05 if bent else 0.0, 0.0, 0.2])),
        grasp=np.eye(4),
        base=BaseRegion(Interval(-1.0, 1.0), Interval(-1.0, 1.0), Interval(0.0, 0.0)),
        lower=made.lower,
        upper=made.upper,
        reference=made.reference,
        weights=range_weights(made.lower, made.upper),
        freedom=given,
    )
    return Cell(line(start, end, M), (arm,))


def displacements(cell: Cell, layout: Layout, index: int = 0) -> Floats:
    """(m, 4, 4) from the TCP that the task asks for to where the joints take it, in its own frame, by Pinocchio."""
    arm, found = cell.arms[index], layout.placements[index]
    reached = arm.base_in_world(found.position, found.yaw) @ flange_poses(arm.robot, found.joints) @ arm.tool
    moved: Floats = inverse(cell.task.poses @ arm.grasp) @ reached
    return moved


@pytest.mark.parametrize("seed", [0, 1, 8, 9, 14, 23])
def test_a_free_roll_is_as_good_as_brute_force(seed: int) -> None:
    cell = free_roll_cell(seed)
    found = search_arm(cell, cell.arms[0], Settings(), time.perf_counter() + 60.0)
    grid = best_on_grid(cell, bases=13, yaws=18, rolls=24)
    assert found.best is not None
    assert found.objective <= 1.001 * grid.objective


def test_a_free_roll_moves_the_tool_about_its_axis_alone_and_is_used_continuously() -> None:
    limited = replace(free_roll(M), steps=np.append(np.full(SIZE - 1, np.inf), 0.2))
    given = optimize(cell_of(None), QUIET)
    for kind, most in ((free_roll(M), np.pi), (limited, 0.2)):
        cell = cell_of(kind)
        layout = optimize(cell, QUIET)
        assert layout.outcome is Outcome.FEASIBLE
        assert given.objective is not None
        assert layout.objective is not None
        assert layout.objective < 0.5 * given.objective
        moved = displacements(cell, layout)
        assert np.max(np.abs(moved[:, :3, 3])) < 1e-7
        assert np.max(np.abs(moved[:, 2, 2] - 1.0)) < 1e-12
        roll = np.unwrap(np.arctan2(moved[:, 1, 0], moved[:, 0, 0]))
        assert np.max(np.abs(np.diff(roll))) <= most + 1e-6
        assert layout.placements[0].displacement is not None
        assert np.allclose(np.unwrap(layout.placements[0].displacement.values[:, 0]), roll, atol=1e-6) or np.allclose(
            np.cos(layout.placements[0].displacement.values[:, 0]), np.cos(roll), atol=1e-6
        )


def test_a_roll_about_the_last_joint_is_proved_and_costs_that_joint_nothing() -> None:
    cell = cell_of(free_roll(M), bent=0.0)
    layout = optimize(cell, Settings(certificate=CertificateSettings(0.01, 20.0)))
    assert layout.outcome is Outcome.OPTIMAL
    grid = best_on_grid(cell, bases=13, yaws=18, rolls=24)
    assert layout.certificate is not None
    assert layout.certificate.lower_bound is not None
    assert layout.objective is not None
    assert layout.certificate.lower_bound <= layout.objective <= 1.001 * grid.objective
    assert np.ptp(layout.placements[0].joints[:, -1]) == 0.0


def test_a_cone_keeps_the_axis_inside_and_the_roll_to_its_range() -> None:
    given, cell = (
        optimize(cell_of(None), QUIET),
        cell_of(freedom({3: (-0.3, 0.3), 4: (-0.3, 0.3), 7: (-0.2, 0.4)}, 0.3)),
    )
    layout = optimize(cell, QUIET)
    assert layout.objective is not None
    assert given.objective is not None
    assert layout.objective < given.objective
    moved = displacements(cell, layout)
    tilt = np.arccos(np.clip(moved[:, 2, 2], -1.0, 1.0))
    assert np.max(tilt) <= 0.3 + 1e-6
    assert np.max(tilt) > 0.25  # it is used
    shortest = np.stack([-moved[:, 1, 2], moved[:, 0, 2], np.zeros(M)], axis=1)
    shortest *= (tilt / np.maximum(np.linalg.norm(shortest, axis=1), 1e-12))[:, None]
    roll = (Rotation.from_rotvec(shortest).inv() * Rotation.from_matrix(moved[:, :3, :3])).as_rotvec()
    assert np.max(np.abs(roll[:, :2])) < 1e-6
    assert np.all((roll[:, 2] >= -0.2 - 1e-6) & (roll[:, 2] <= 0.4 + 1e-6))


@pytest.mark.parametrize("frame", [Frame.TOOL, Frame.WORLD])
def test_boxes_hold_and_are_bounded_from_below(frame: Frame) -> None:
    box: Ranges = {0: (-0.02, 0.02), 2: (0.0, 0.03), 5: (-0.1, 0.1), 6: (-0.1, 0.05), 7: (-0.1, 0.1)}
    given, cell = optimize(cell_of(None), QUIET), cell_of(freedom(box, frame=frame))
    layout = optimize(cell, Settings(certificate=CertificateSettings(0.01, 3.0)))
    assert layout.objective is not None
    assert given.objective is not None
    assert layout.objective < given.objective
    moved = displacements(cell, layout)
    if frame is Frame.WORLD:
        hands = (cell.task.poses @ cell.arms[0].grasp)[:, :3, :3]
        moved[:, :3, 3] = (hands @ moved[:, :3, 3, None])[..., 0]
        moved[:, :3, :3] = hands @ moved[:, :3, :3] @ hands.swapaxes(1, 2)
    turns = Rotation.from_matrix(moved[:, :3, :3]).as_euler("XYZ")
    values = np.concatenate([moved[:, :3, 3], turns], axis=1)
    low = np.array([box.get(i, (0.0, 0.0))[0] for i in (0, 1, 2, 5, 6, 7)])
    high = np.array([box.get(i, (0.0, 0.0))[1] for i in (0, 1, 2, 5, 6, 7)])
    assert np.all(values >= low - 1e-6)
    assert np.all(values <= high + 1e-6)
    assert layout.certificate is not None
    assert layout.certificate.lower_bound is not None
    assert layout.certificate.lower_bound <= layout.objective


def test_one_displacement_for_all_poses() -> None:
    cell = cell_of(freedom({0: (-0.05, 0.05), 7: (-np.inf, np.inf)}, steps=0.0))
    layout = optimize(cell, QUIET)
    assert layout.usable
    moved = displacements(cell, layout)
    assert np.max(np.abs(moved - moved[0])) < 2e-6
    assert np.max(np.abs(moved[0, :3, :3] - np.eye(3))) > 0.1


def test_nothing_that_is_open_gives_the_answer_of_given_poses() -> None:
    given, same = optimize(cell_of(None), QUIET), optimize(cell_of(freedom({})), QUIET)
    assert given.objective is not None
    assert same.objective == pytest.approx(given.objective, rel=1e-9)


def test_a_wide_tolerance_has_no_bound_and_says_why() -> None:
    layout = optimize(cell_of(free_roll(M)), Settings(certificate=CertificateSettings(0.01, 3.0)))
    assert layout.outcome is Outcome.FEASIBLE
    assert layout.certificate is not None
    assert layout.certificate.lower_bound is None
    assert "turn_z" in layout.certificate.arms[0].note


def test_a_task_that_is_proved_impossible_as_it_is_gets_a_layout_by_its_roll() -> None:
    made = robot("puma560")
    cells = []
    for kind in (None, free_roll(M)):
        cell = cell_of(kind, "puma560", 0.0)
        narrow = np.where(np.arange(6) == 5, 0.3, np.inf)
        middle = 1.2
        arm = replace(
            cell.arms[0],
            lower=np.maximum(made.lower, middle - narrow),
            upper=np.minimum(made.upper, middle + narrow),
            reference=np.where(np.arange(6) == 5, middle, made.reference),
        )
        cells.append(replace(cell, arms=(arm,)))
    given, rolled = (optimize(cell, Settings(certificate=CertificateSettings(0.05, 10.0))) for cell in cells)
    assert given.outcome is Outcome.INFEASIBLE
    assert rolled.usable


def test_what_is_wide_open_is_never_called_impossible_without_a_proof() -> None:
    cell = cell_of(free_roll(M))
    arm = replace(cell.arms[0], base=BaseRegion(Interval(0.4, 0.42), Interval(0.0, 0.02), Interval(0.25, 0.25)))
    layout = optimize(replace(cell, arms=(arm,)), Settings(certificate=CertificateSettings(0.05, 3.0)))
    assert layout.outcome in (Outcome.UNKNOWN, Outcome.FEASIBLE)
    far = replace(arm, base=BaseRegion(Interval(9.0, 9.5), Interval(0.0, 0.02), Interval(0.0, 0.0)))
    assert optimize(replace(cell, arms=(far,)), QUIET).outcome is Outcome.INFEASIBLE  # beyond reach, whatever the roll


def test_arms_that_are_tied_keep_the_tie_and_what_is_open() -> None:
    cell = cell_of(free_roll(M))
    other = replace(cell.arms[0], name="other", grasp=transform(np.eye(3), np.array([0.0, 0.25, 0.0])))
    tied = replace(cell, arms=(cell.arms[0], other), couplings=(Distance((0, 1), 0.9, 1.4),))
    layout = optimize(tied, QUIET)
    assert layout.outcome is Outcome.FEASIBLE
    places = [placement.position for placement in layout.placements]
    assert 0.9 - 1e-6 <= np.linalg.norm((places[0] - places[1])[:2]) <= 1.4 + 1e-6
    for index in (0, 1):
        moved = displacements(tied, layout, index)
        assert np.max(np.abs(moved[:, :3, 3])) < 1e-6
        assert np.max(np.abs(moved[:, 2, 2] - 1.0)) < 1e-10
    assert layout.verification is not None
    assert layout.verification.tolerances_respected
