"""Limits between joints are kept like those of single joints, at the poses and between them, and never proved away."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Distance
from duocell.models.cell.surroundings import Surroundings
from duocell.models.cell.task import Task
from duocell.models.robot.arm import Arm, BaseRegion
from duocell.models.robot.linear_limits import LinearLimits
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.nlp.program import ArmSolution, build_program
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import CertificateSettings, Settings, ToleranceSettings
from tests.support.given.arms import make_arm, only_at, region
from tests.support.given.cells import Scene
from tests.support.oracles.brute import USELESS, _paths, branches_of, path_cost
from tests.support.oracles.dense import dense_path

TOOL = transform(np.eye(3), [0.0, 0.0, 0.1])
SHOULDER = [0.0, 1.0, 1.0, 0.0, 0.0, 0.0]
SEARCH = Settings(certificate=None)


def sums(*rows: tuple[list[float], float, float]) -> LinearLimits:
    names = tuple(f"sum {k}" for k in range(len(rows)))
    matrix, lower, upper = zip(*rows, strict=True)
    return LinearLimits(names, np.array(matrix), np.array(lower), np.array(upper))


def cell_of(robot: str = "lrmate200id", count: int = 8, base: BaseRegion | None = None) -> Cell:
    """One arm that carries a part over a table, turning it."""
    shares = np.linspace(0.0, 1.0, count)[:, None]
    down = transform(rotation_x(np.pi), [0.0, 0.0, 0.0])
    way = transform(rotation_z(0.8 * shares[:, 0]), [0.35, -0.25, 0.25] + shares * [0.0, 0.5, 0.2])
    place = base or region((-0.6, 0.6), (-0.6, 0.6))
    tool = catalogue.robot(robot).flange() @ TOOL
    return Cell(Task(way @ down), (make_arm(robot, tool=tool, base=place),))


def with_sums(cell: Cell, limits: LinearLimits | None) -> Cell:
    return replace(cell, arms=(replace(cell.arms[0], linear_limits=limits), *cell.arms[1:]))


def joints_of(layout: Layout) -> Floats:
    assert layout.usable, layout.reasons
    return layout.placements[0].joints


def beyond(cell: Cell, layout: Layout, steps: int = 25) -> float:
    """rad by which sums leave their range anywhere on the way, followed by Pinocchio alone."""
    bases = [arm.base_in_world(p.position, p.yaw) for arm, p in zip(cell.arms, layout.placements, strict=True)]
    scene = Scene(cell, Surroundings(), np.array(bases), [p.joints for p in layout.placements])
    _, ways = dense_path(scene, steps)
    worst = -np.inf
    for arm, way in zip(cell.arms, ways, strict=True):
        if arm.linear_limits is not None:
            values = way @ arm.linear_limits.matrix.T
            worst = max(worst, np.max(arm.linear_limits.lower - values), np.max(values - arm.linear_limits.upper))
    return worst


# --- against brute force ----------------------------------------------------------------------------------------------


def cost_at(cell: Cell, arm: Arm, place: Floats) -> float:
    """Least objective from a place over postures that keep the sums; for joints 2 and 3 with less than a turn."""
    targets = cell.flange_targets(arm).copy()
    targets[:, :3, 3] -= [*place, 0.0]
    layers = [branches_of(arm.robot, target) for target in targets]
    if not all(map(len, layers)) or arm.linear_limits is None:
        return USELESS
    best, middle = USELESS, 0.5 * (arm.lower + arm.upper)
    for path in _paths(arm.robot, layers):
        own = middle + (path - middle + np.pi) % (2.0 * np.pi) - np.pi
        values = own @ arm.linear_limits.matrix.T
        if np.all((values >= arm.linear_limits.lower) & (values <= arm.linear_limits.upper)):
            best = min(best, path_cost(cell, arm, path))
    return best


def brute_force(cell: Cell) -> float:
    """Best of a grid of places; from its best three downhill by circles, as long as these find something better.

    Two active sums leave a wedge of places whose tip is best: that takes many directions.
    """
    arm, axis, turns = cell.arms[0], np.linspace(-0.6, 0.6, 13), np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    values = np.array([cost_at(cell, arm, point) for point in points])
    circle, best = np.stack([np.cos(turns), np.sin(turns)], axis=-1), np.inf
    for index in np.argsort(values)[:3]:
        place, here, radius = points[index], values[index], 0.05
        while radius > 2e-5:
            around = np.clip(place + radius * circle, -0.6, 0.6)
            costs = [cost_at(cell, arm, point) for point in around]
            if min(costs) < here:
                place, here = around[int(np.argmin(costs))], min(costs)
            else:
                radius *= 0.5
        best = min(best, here)
    return best


def test_the_answer_keeps_a_sum_that_the_optimum_without_it_breaks() -> None:
    free = cell_of(count=4)
    plain = optimize(free, SEARCH)
    most = float(np.max(joints_of(plain) @ SHOULDER))
    cell = with_sums(free, sums((SHOULDER, -3.0, most - 0.3)))
    assert plain.objective is not None
    assert cost_at(free, with_sums(free, sums((SHOULDER, -9.0, 9.0))).arms[0], plain.placements[0].position[:2]) == (
        pytest.approx(plain.objective, rel=1e-6)
    )
    found = optimize(cell)
    assert beyond(cell, found) <= 1e-6
    assert found.objective is not None
    assert found.objective > 1.05 * plain.objective
    assert found.objective == pytest.approx(brute_force(cell), rel=1e-3)
    assert found.outcome is Outcome.OPTIMAL
    assert found.placements[0].linear_margins[0][0] == "sum 0"
    assert abs(found.placements[0].linear_margins[0][1]) < 1e-6


def test_a_sum_is_kept_between_the_poses_too() -> None:
    """It is lowest between two poses here: what keeps it at the poses alone is cheaper, and not the answer."""
    free = cell_of()
    least = float(np.min(joints_of(optimize(free, SEARCH)) @ SHOULDER))
    cell = with_sums(free, sums((SHOULDER, least + 0.3, 3.0)))
    found = optimize(cell, SEARCH)
    assert beyond(cell, found) <= 1e-6
    assert found.placements[0].linear_margins[0][1] > 1e-3


# --- a sum of one joint is that joint's limit -------------------------------------------------------------------------


def of_one_joint(cell: Cell, joint: int, low: float, high: float) -> tuple[Cell, Cell]:
    """The cell with a limit of one joint of its first arm, and with the same as a sum."""
    arm = cell.arms[0]
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[joint], upper[joint] = low, high
    limited = replace(cell, arms=(replace(arm, lower=lower, upper=upper), *cell.arms[1:]))
    return limited, with_sums(cell, sums((list(np.eye(arm.dof)[joint]), low, high)))


@pytest.mark.parametrize(
    ("robot", "joint", "low", "high"),
    [
        ("lrmate200id", 2, 0.15, 3.0),
        ("lrmate200id", 0, -0.3, 2.9),  # joint 1: the yaw has to heed it
        ("ur10e", 5, 3.0, 6.2),  # another turn than the cheapest
        ("ur10e", 0, 3.0, 6.2),
    ],
)
def test_a_sum_of_one_joint_is_its_limit(robot: str, joint: int, low: float, high: float) -> None:
    free = cell_of(robot, 4, base=region((-0.6, 0.0), (-0.3, 0.6), yaw=(0.0, 0.6)))
    by_limit, by_sum = (optimize(cell, SEARCH) for cell in of_one_joint(free, joint, low, high))
    assert by_limit.usable
    assert by_sum.objective == pytest.approx(by_limit.objective, rel=1e-6)


def test_a_sum_of_one_joint_is_its_limit_for_arms_with_a_joint_to_spare() -> None:
    free = cell_of("iiwa14", 4)
    plain = joints_of(optimize(free, SEARCH))
    limited, summed = of_one_joint(free, 3, -2.0, float(np.max(plain[:, 3])) - 0.2)
    by_limit, by_sum = optimize(limited, SEARCH), optimize(summed, SEARCH)
    assert by_sum.objective == pytest.approx(by_limit.objective, rel=1e-3)
    assert beyond(summed, by_sum) <= 1e-6


def test_arms_of_one_cell_keep_their_sums() -> None:
    """Two arms whose bases must be apart: the limit of one joint, told either way, gives the same layout."""
    cell = cell_of(count=2)
    first = cell.arms[0]
    second = replace(first, name="second", grasp=transform(np.eye(3), [0.1, 0.0, 0.0]))
    cell = replace(cell, arms=(first, second), couplings=(Distance((0, 1), 0.5, 2.0),))
    plain = optimize(cell, SEARCH)
    most = float(np.max(joints_of(plain)[:, 1])) - 0.15
    limited, summed = of_one_joint(cell, 1, -1.7, most)
    by_limit, by_sum = optimize(limited, SEARCH), optimize(summed, SEARCH)
    assert plain.objective is not None
    assert by_limit.objective is not None
    assert by_limit.objective > 1.001 * plain.objective
    assert by_sum.objective == pytest.approx(by_limit.objective, rel=1e-3)
    assert beyond(summed, by_sum) <= 1e-6


def test_what_errors_of_the_base_leave_of_a_sum() -> None:
    free = cell_of(count=3, base=region(-0.2, 0.0, yaw=0.0))
    q = joints_of(optimize(free, SEARCH))
    limited, summed = of_one_joint(free, 1, -1.7, float(np.max(q[:, 1])) + 1e-3)
    settings = replace(SEARCH, tolerance=ToleranceSettings())
    by_limit, by_sum = optimize(limited, settings).tolerance, optimize(summed, settings).tolerance
    assert by_limit is not None
    assert by_sum is not None
    assert by_sum.margin == pytest.approx(by_limit.margin, abs=1e-9)
    assert by_sum.margin_by_sensitivity == pytest.approx(by_limit.margin_by_sensitivity, abs=1e-9)
    assert by_sum.largest == pytest.approx(by_limit.largest, rel=1e-6)
    assert "sum 0 reaches its limit" in by_sum.note


# --- what is said where there is no layout ----------------------------------------------------------------------------


def test_a_sum_that_no_base_keeps_is_proved_and_named() -> None:
    cell = with_sums(cell_of(count=3, base=region((-0.1, 0.1), (-0.2, 0.2))), sums((SHOULDER, 2.6, 3.2)))
    found = optimize(cell, replace(Settings(), explain=True))
    assert found.outcome is Outcome.INFEASIBLE
    assert {reason.kind for reason in found.reasons} <= {"joint_limit", "out_of_reach"}
    assert any(reason.joint == "sum 0" for reason in found.reasons)
    places = product(np.linspace(-0.1, 0.1, 4), np.linspace(-0.2, 0.2, 7))
    assert all(cost_at(cell, cell.arms[0], np.array(place)) == USELESS for place in places)
    assert found.explanation is not None
    assert "linear limit of arm / sum 0" in found.explanation.blocking
    help_ = {one.pointer: one.objective for one in found.explanation.relaxations}
    assert help_["/arms/0/linear_limits/0"] is not None


def test_an_evaluation_names_the_sum_that_is_broken() -> None:
    free = cell_of(count=3)
    plain = optimize(free, SEARCH)
    placed = plain.placements[0]
    base = only_at(placed.position, placed.yaw)
    cell = with_sums(replace(free, arms=(replace(free.arms[0], base=base),)), sums((SHOULDER, 2.0, 3.0)))
    for joints in ([placed.joints], None):
        found = evaluate_layout(cell, joints)
        assert found.outcome is Outcome.INFEASIBLE
        named = [reason for reason in found.reasons if reason.joint == "sum 0"]
        assert named
        assert named[0].kind == "joint_limit"
    assert found.verification is not None
    assert not found.verification.limits_respected


# --- bounds and rows --------------------------------------------------------------------------------------------------


def test_boxes_without_a_sum_hold_no_place_that_keeps_it() -> None:
    """Whatever the bound excludes: no place among many keeps all limits there; and with the sum it is higher."""
    free = cell_of(count=4)
    wanted = sums((SHOULDER, -3.0, 0.3), ([0.5, 0.0, 1.0, 0.0, 0.0, 0.0], -2.0, 0.6))
    problem, plain = (reduced_problem(cell, cell.arms[0]) for cell in (with_sums(free, wanted), free))
    assert problem is not None
    assert plain is not None
    rng = np.random.default_rng(3)
    places = np.column_stack([rng.uniform(-0.6, 0.6, (8000, 2)), np.zeros(8000)])
    paths = evaluate(problem, places)
    best = float(np.min(np.where(paths.violation <= 0.0, paths.objective, np.inf)))
    proof = certify(problem, None, CertificateSettings(gap=0.03, boxes=20_000))
    without = certify(plain, None, CertificateSettings(gap=0.03, boxes=20_000))
    assert proof.lower_bound is not None
    assert without.objective is not None
    assert proof.objective is not None
    assert without.objective < 0.99 * proof.lower_bound
    assert proof.lower_bound <= proof.objective <= best * 1.03
    assert proof.lower_bound <= best


def test_rows_of_the_program_follow_the_sums() -> None:
    free = cell_of(count=3)
    cell = with_sums(free, sums((SHOULDER, -3.0, 0.3), ([0.0, 0.0, -0.5, 0.0, 2.0, 0.0], -2.0, 0.6)))
    arm, rng = cell.arms[0], np.random.default_rng(1)
    point = ArmSolution(np.zeros(3), 0.0, rng.uniform(-1.0, 1.0, (3, 6)))
    program = build_program(cell, [arm], [point], steps=True)
    assert arm.linear_limits is not None
    rows, slopes = program.structure.jacobian(program.pack([point]), program.parameters)
    np.testing.assert_allclose(np.array(rows).ravel()[-6:], arm.linear_limits.values(point.joints).ravel(), atol=1e-12)
    np.testing.assert_allclose(program.rows_upper[-6:], [0.3, 0.6] * 3)
    expected = np.kron(np.eye(3), arm.linear_limits.matrix)
    np.testing.assert_allclose(np.array(slopes.full())[-6:, 4:], expected, atol=1e-12)
    assert [label for label in program.labels() if "sum" in label][:2] == ["arm / sum 0, pose 0", "arm / sum 1, pose 0"]
