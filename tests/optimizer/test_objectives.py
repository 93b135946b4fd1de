"""Other objectives than joint availability: found as well, told as honestly, scored alike everywhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Distance
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.kinematics import characteristic_length, jacobians
from duocell.models.objective.measure import Measure
from duocell.models.objective.objective import JOINT_AVAILABILITY, Objective, Term
from duocell.models.objective.registry import objective_from
from duocell.models.robot.arm import Arm, BaseRegion, Interval
from duocell.models.robot.robot import Robot
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import CertificateSettings, Settings
from duocell.requests import read_request
from tests.support.given.arms import general_six
from tests.support.given.blocked import blocked_by, far_box, one_arm
from tests.support.given.tasks import possible
from tests.support.oracles.brute import USELESS, brute_force, path_cost, paths_at

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MANIPULABILITY = objective_from([("manipulability", 1.0)])
BOTH = objective_from([("joint_availability", 1.0), ("manipulability", 5.0)])
QUICK = Settings(certificate=None)


def pair() -> Cell:
    """The example of a line, on four of its ten poses."""
    cell = read_request(EXAMPLES / "line.json").cell
    return replace(cell, task=Task(cell.task.poses[::3]))


def line(arm: int) -> Cell:
    """One of its arms by itself."""
    return replace(pair(), arms=(pair().arms[arm],))


def by_pinocchio(arm: Arm, joints: np.ndarray) -> float:
    """Σ 1 / w over the poses."""
    jacobian = jacobians(arm.robot, joints, arm.tool)
    jacobian[:, :3] /= characteristic_length(arm.robot)
    return float(np.sum(1.0 / np.sqrt(np.linalg.det(jacobian @ np.swapaxes(jacobian, 1, 2)))))


def judged(cell: Cell, arm: Arm, position: np.ndarray) -> float:
    """Least objective at a base, by branches of another program and Pinocchio's Jacobians."""
    weights = {term.measure.name: term.weight for term in cell.objective.terms}
    values = [USELESS]
    for path in paths_at(cell, arm, position):
        availability = path_cost(cell, arm, path)
        if availability < USELESS:
            volume = weights["manipulability"] * by_pinocchio(arm, path)
            values.append(volume + weights.get("joint_availability", 0.0) * availability)
    return min(values)


def value_of(layout: Layout) -> float:
    """The objective of a layout that is there."""
    assert layout.objective is not None
    return layout.objective


# --- one arm: against brute force -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("objective", "arm"), [(MANIPULABILITY, 0), (BOTH, 1)], ids=["alone", "sum"])
def test_nothing_better_is_found_by_brute_force(objective: Objective, arm: int) -> None:
    cell = replace(line(arm), objective=objective)
    layout = optimize(cell, QUICK)
    assert layout.outcome is Outcome.FEASIBLE
    best = brute_force(cell, cell.arms[0], (15, 15, 1), judge=judged)
    assert value_of(layout) <= best * 1.001
    (placement,) = layout.placements
    known = judged(cell, cell.arms[0], placement.position)  # it is worth there what is said
    assert value_of(layout) == pytest.approx(known, rel=1e-4)


@pytest.mark.parametrize("robot", ["ur5e", general_six(), "iiwa14"], ids=["ur5e", "general_six", "iiwa14"])
def test_manipulability_is_found_for_arms_of_all_kinds(robot: str | Robot) -> None:
    """In closed form, without one, and redundant: better than the witness, and than the layout of best availability."""
    task = possible(robot, np.random.default_rng(4), poses=4, step=0.08, half=(0.2, 0.2, 0.0, np.pi))
    cell = replace(task.cell, objective=MANIPULABILITY)
    usual, asked = optimize(task.cell, QUICK), optimize(cell, QUICK)
    (placement,) = asked.placements
    assert value_of(asked) == pytest.approx(by_pinocchio(task.arm, placement.joints), rel=1e-8)
    assert value_of(asked) <= by_pinocchio(task.arm, task.joints) * 1.001
    assert value_of(asked) <= by_pinocchio(task.arm, usual.placements[0].joints) * 1.001


class Facing(Measure):
    """How far joint 1 is turned from a direction: a measure that the yaw in closed form does not suit."""

    name: ClassVar[str] = "facing"
    unit: ClassVar[str] = "1"
    cost_unit: ClassVar[str] = "1"
    source: ClassVar[str] = "this test"
    direction: ClassVar[float] = 1.9

    def values(self, arm: Arm, joints: Floats) -> Floats:
        return np.asarray(1.1 - np.cos(joints[..., 0] - self.direction))

    def expression(self, robot: Robot, joints: ca.SX, numbers: ca.SX) -> ca.SX:
        return 1.1 - ca.cos(joints[0] - self.direction)

    def scale(self, arm: Arm) -> float:
        return 1.0


def test_yaws_are_searched_for_measures_that_do_not_keep_the_reduction() -> None:
    task = possible("ur5e", np.random.default_rng(2), poses=4, half=(0.2, 0.2, 0.0, np.pi))
    cell = replace(task.cell, objective=Objective((Term(Facing()),)))
    arm = cell.arms[0]
    problem, here = reduced_problem(cell, arm), task.position[None]
    assert problem is not None
    paths = evaluate(problem, here)
    usual = evaluate(problem.for_bounds(), here)
    usable = np.flatnonzero(usual.violation[:, 0] == 0.0)
    assert len(usable)
    for k in usable:
        assert paths.violation[k, 0] == 0.0
        first = usual.joints[0, k, 0] + np.linspace(-np.pi, np.pi, 721)[:, None]
        costs = np.sum(1.1 - np.cos(first - Facing.direction), axis=1)
        inside = np.all((first >= arm.lower[0]) & (first <= arm.upper[0]), axis=1)
        assert paths.objective[k, 0] <= np.min(costs[inside]) + 4 * 0.01  # an eighth of a turn's square
        turned = paths.joints[0, k, 0] - usual.joints[0, k, 0]
        assert turned == pytest.approx(np.full(4, turned[0]), abs=1e-9)
        away = paths.yaw[k, 0] - usual.yaw[k, 0] + problem.sigma * turned[0]
        assert np.sin(0.5 * away) == pytest.approx(0.0, abs=1e-9)  # the hand stays where it is
    least = 4 * 0.1
    assert least <= value_of(optimize(cell, QUICK)) <= float(np.min(paths.objective[:, 0])) + 1e-9


# --- what is told -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("certificate", ["auto", CertificateSettings(0.01, 5.0)])
def test_no_bound_is_told_where_none_is_known(certificate: CertificateSettings) -> None:
    layout = optimize(replace(line(0), objective=BOTH), Settings(certificate=certificate))
    assert layout.outcome is Outcome.FEASIBLE
    found = layout.certificate
    assert found is not None
    assert (found.lower_bound, found.gap, found.proved) == (None, None, False)
    (arm,) = found.arms
    assert (arm.lower_bound, arm.gap, arm.proved) == (None, None, False)
    assert "no lower bound is known of 1 joint_availability + 5 manipulability" in arm.note


@pytest.mark.parametrize("weight", [0.25, 3.0])
def test_a_weight_of_joint_availability_is_in_its_bound(weight: float) -> None:
    cell = replace(line(0), objective=objective_from([("joint_availability", weight)]))
    wanted = CertificateSettings(0.01, 20.0)
    usual, asked = (optimize(one, Settings(certificate=wanted)) for one in (line(0), cell))
    assert value_of(asked) == pytest.approx(weight * value_of(usual), rel=1e-5)
    assert usual.certificate is not None
    assert asked.certificate is not None
    assert asked.certificate.lower_bound == pytest.approx(weight * (usual.certificate.lower_bound or 0.0), rel=1e-3)
    problem = reduced_problem(cell, cell.arms[0])
    assert problem is not None
    alone = certify(problem, None, wanted).lower_bound  # that nothing known caps
    assert alone is not None
    assert 0.97 * value_of(asked) <= alone <= value_of(asked) * (1.0 + 1e-6)


def test_what_cannot_be_done_is_proved_whatever_is_asked_for() -> None:
    cell = line(0)
    narrow = replace(cell.arms[0], lower=cell.arms[0].reference - 0.2, upper=cell.arms[0].reference + 0.2)
    usual = optimize(replace(cell, arms=(narrow,)), Settings())
    asked = optimize(replace(cell, arms=(narrow,), objective=MANIPULABILITY), Settings())
    assert usual.outcome is asked.outcome is Outcome.INFEASIBLE
    assert [reason.kind for reason in asked.reasons] == [reason.kind for reason in usual.reasons]


def test_baselines_say_that_they_minimise_something_else() -> None:
    cell = line(0)
    cell = replace(cell, task=Task(cell.task.poses[:2]))
    settings = Settings(certificate=None, baselines=("exterior-penalty",))
    (usual,), (asked,) = (optimize(replace(cell, objective=o), settings).baselines for o in (cell.objective, BOTH))
    assert asked.objective == usual.objective
    assert "minimises joint_availability" in asked.note
    assert "minimises" not in usual.note


def test_terms_and_measures_add_up() -> None:
    cell = replace(pair(), objective=BOTH)
    layout = optimize(cell, QUICK)
    terms = layout.objective_terms
    assert [(term.measure, term.weight, term.unit) for term in terms] == [
        ("joint_availability", 1.0, "rad²"),
        ("manipulability", 5.0, "1"),
    ]
    assert sum(term.weight * term.cost for term in terms) == pytest.approx(value_of(layout), rel=1e-12)
    assert terms[1].cost == pytest.approx(
        sum(by_pinocchio(arm, one.joints) for arm, one in zip(cell.arms, layout.placements, strict=True)), rel=1e-9
    )
    assert sum(segment.objective or 0.0 for segment in layout.segments) == pytest.approx(value_of(layout), rel=1e-12)
    for arm, placement in zip(cell.arms, layout.placements, strict=True):
        by_name = {one.measure: one for one in placement.measures}
        assert list(by_name) == ["joint_availability", "manipulability"]
        volumes = np.array([1.0 / by_pinocchio(arm, row[None]) for row in placement.joints])
        told = by_name["manipulability"]
        assert (told.minimum, told.mean, told.maximum) == pytest.approx((volumes.min(), volumes.mean(), volumes.max()))


# --- other ways in ----------------------------------------------------------------------------------------------------


def fixed(cell: Cell, layout: Layout) -> Cell:
    """The cell with its bases where a layout has them."""
    arms = []
    for arm, placement in zip(cell.arms, layout.placements, strict=True):
        x, y, z = (Interval(value, value) for value in placement.position.tolist())
        arms.append(replace(arm, base=BaseRegion(x, y, z, Interval(placement.yaw, placement.yaw))))
    return replace(cell, arms=tuple(arms))


def test_an_evaluation_scores_with_what_is_asked_for() -> None:
    cell = replace(line(0), objective=MANIPULABILITY)
    layout = optimize(cell, QUICK)
    found = evaluate_layout(fixed(cell, layout))
    assert value_of(found) == pytest.approx(value_of(layout), rel=1e-6)
    joints = layout.placements[0].joints
    given = evaluate_layout(fixed(replace(cell, objective=JOINT_AVAILABILITY), layout), [joints])
    arm = cell.arms[0]
    assert value_of(given) == pytest.approx(float(np.sum(arm.weights * (joints - arm.reference) ** 2)), rel=1e-9)


@pytest.mark.parametrize(("objective", "least", "most"), [(MANIPULABILITY, 0.0, 1.1), (BOTH, 1.75, 3.0)])
def test_nothing_better_is_found_for_arms_that_are_tied(objective: Objective, least: float, most: float) -> None:
    """Two bases within a distance of each other, against all pairs of a grid: samples and quadratic programs."""
    cell = replace(pair(), objective=objective)
    tied = replace(cell, couplings=(Distance((0, 1), least, most),))
    layout = optimize(tied, QUICK)
    first, second = (placement.position for placement in layout.placements)
    apart = float(np.linalg.norm(first - second))
    assert least - 1e-6 <= apart <= most + 1e-6
    assert not least < apart - 1e-3 < apart + 1e-3 < most  # the tie costs something
    grid = np.stack(np.meshgrid(np.linspace(-0.3, 2.1, 41), np.linspace(-0.7, 1.7, 41)), axis=-1).reshape(-1, 2)
    places = np.column_stack([grid, np.zeros(len(grid))])
    costs = []
    for arm in cell.arms:
        problem = reduced_problem(cell, arm)
        assert problem is not None
        paths = evaluate(problem, places)
        costs.append(np.min(np.where(paths.violation == 0.0, paths.objective, np.inf), axis=0))
    far = np.linalg.norm(places[:, None] - places, axis=-1)
    pairs = np.where((far >= least) & (far <= most), costs[0][:, None] + costs[1], np.inf)
    assert value_of(layout) <= float(np.min(pairs)) * 1.001


def test_a_cell_with_bodies_is_brought_to_what_is_asked_for() -> None:
    """An obstacle that is in nobody's way changes nothing; one where the arm would stand makes it stand elsewhere."""
    given = replace(one_arm("ur5e"), objective=MANIPULABILITY)
    free = optimize(given, QUICK)
    aside = optimize(replace(given, surroundings=blocked_by(far_box())), QUICK)
    assert value_of(aside) == pytest.approx(value_of(free), rel=1e-4)
    place = free.placements[0].position
    post = Body("post", transform(np.eye(3), [*place[:2], 0.5]), Box(np.array([0.1, 0.1, 1.0])))
    beside = optimize(replace(given, surroundings=blocked_by(post)), QUICK)
    assert beside.outcome is Outcome.FEASIBLE
    assert value_of(beside) >= value_of(free) * (1.0 - 1e-6)
    assert value_of(beside) <= 1.5 * value_of(free)
