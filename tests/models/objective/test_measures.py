"""Every measure: its figures against another way to them, its derivatives, and what it promises."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.kinematics import characteristic_length, jacobians
from duocell.models.objective.joint_availability import JointAvailability
from duocell.models.objective.manipulability import LEAST, Manipulability
from duocell.models.objective.measure import Measure
from duocell.models.objective.objective import JOINT_AVAILABILITY, NOTHING, Objective, Term
from duocell.models.objective.pose_cost import pose_cost
from duocell.models.objective.registry import MEASURES, objective_from
from duocell.models.robot.arm import TURN, Arm
from duocell.models.robot.joint import JointKind
from duocell.models.robot.robot import Robot
from tests.support.given.arms import make_arm
from tests.support.given.linear_axis import on_linear_axis, without_joint

ROBOTS = (
    *(catalogue.robot(name) for name in ("puma560", "ur10e", "iiwa14")),
    on_linear_axis("ur5e"),
    without_joint(catalogue.robot("ur5e"), 3),  # five joints
)
EVERY = [(measure, robot) for measure in MEASURES.values() for robot in ROBOTS]
SUM = Objective((Term(JointAvailability(), 0.5), Term(Manipulability(), 20.0)))


def arm_of(robot: str | Robot) -> Arm:
    """With a tool, a reference and weights like no other's."""
    rng = np.random.default_rng(1)
    arm = make_arm(robot)
    tool = transform(np.eye(3), np.array([0.1, -0.05, 0.2]))
    return replace(
        arm, tool=tool, reference=rng.uniform(-1.0, 1.0, arm.dof), weights=rng.choice([0.0, 1.0, 2.5], arm.dof)
    )


def postures(arm: Arm, count: int, seed: int = 0) -> np.ndarray:
    """(count, n) rad, none of them next to a singularity."""
    drawn = np.random.default_rng(seed).uniform(-np.pi, np.pi, (50 * count, arm.dof))
    return drawn[Manipulability().values(arm, drawn) > 0.1][:count]


def differences(cost: Measure, arm: Arm, joints: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """(K, n) central differences of the costs."""
    units = step * np.eye(arm.dof)
    ahead, behind = (cost.costs(arm, joints[:, None] + sign * units) for sign in (1.0, -1.0))
    return np.asarray((ahead - behind) / (2.0 * step))


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_manipulability_is_that_of_pinocchios_jacobian(robot: Robot) -> None:
    arm = arm_of(robot)
    q = postures(arm, 40)
    jacobian = jacobians(arm.robot, q, arm.tool)
    jacobian[:, :3] /= characteristic_length(arm.robot)
    volumes = np.prod(np.linalg.svd(jacobian, compute_uv=False), axis=1)
    assert Manipulability().values(arm, q) == pytest.approx(volumes, rel=1e-9)
    assert Manipulability().costs(arm, q) == pytest.approx(1.0 / volumes, rel=1e-9)


@pytest.mark.parametrize("robot", [one for one in ROBOTS if one.dof >= 6], ids=lambda robot: robot.name)
def test_manipulability_has_the_unit_that_is_said(robot: Robot) -> None:
    """L⁻³ of the value with metres, whatever the tool, for six joints and more."""
    arm = arm_of(robot)
    q = postures(arm, 10)
    for tool in (np.eye(4), arm.tool):
        jacobian = jacobians(arm.robot, q, tool)
        metres = np.sqrt(np.linalg.det(jacobian @ np.swapaxes(jacobian, 1, 2)))
        scaled = metres / characteristic_length(arm.robot) ** 3
        assert Manipulability().values(arm, q) == pytest.approx(scaled, rel=1e-8)


def test_a_singularity_costs_much_but_not_more_than_can_be_counted() -> None:
    arm = arm_of("ur10e")
    straight = np.array([[0.3, -1.0, 0.0, 0.4, 0.5, 0.6], [0.3, -1.0, 0.8, 0.4, 0.0, 0.6]])
    assert Manipulability().values(arm, straight) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert np.all(Manipulability().costs(arm, straight) > 1e8)
    assert np.all(Manipulability().costs(arm, straight) <= 1.0 / LEAST)


def test_joint_availability_is_the_sum_of_weighted_squares() -> None:
    arm = arm_of("puma560")
    q = np.random.default_rng(3).uniform(-6.0, 6.0, (5, 6))
    expected = [sum(w * (a - r) ** 2 for w, a, r in zip(arm.weights, row, arm.reference, strict=True)) for row in q]
    assert JointAvailability().values(arm, q) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("measure", "robot"), EVERY, ids=lambda one: one.name)
def test_symbols_and_derivatives_are_those_of_the_costs(measure: Measure, robot: Robot) -> None:
    arm = arm_of(robot)
    q = postures(arm, 12)
    numbers = measure.numbers(arm)
    assert len(numbers) == measure.size(arm.robot)
    value = pose_cost(measure, arm.robot).value
    costs = measure.costs(arm, q)
    assert [float(value(row, numbers)) for row in q] == pytest.approx(costs, rel=1e-8)
    counts = np.linspace(0.0, 2.0, len(q))
    slopes = counts[:, None] * differences(measure, arm, q)
    assert measure.gradient(arm, q, counts) == pytest.approx(slopes, rel=1e-5, abs=1e-6 * np.max(np.abs(slopes)))
    step, bent = 1e-5, np.empty((len(q), arm.dof, arm.dof))
    for k, unit in enumerate(step * np.eye(arm.dof)):
        ahead, behind = (measure.gradient(arm, q + sign * unit, counts) for sign in (1.0, -1.0))
        bent[:, k] = (ahead - behind) / (2.0 * step)
    assert measure.curvature(arm, q, counts) == pytest.approx(bent, rel=1e-5, abs=1e-6 * np.max(np.abs(bent)))


@pytest.mark.parametrize(("measure", "robot"), EVERY, ids=lambda one: one.name)
def test_what_is_faster_is_what_is_derived(measure: Measure, robot: Robot) -> None:
    """Many paths at once, and derivatives by hand where a measure has them, are those of the general way."""
    arm = arm_of(robot)
    q = postures(arm, 12)
    paths = np.moveaxis(q.reshape(2, 3, 2, arm.dof), -1, 0)  # 2 × 3 paths of 2 poses
    counts = np.array([0.5, 2.0])
    one_by_one = [[sum(counts * measure.costs(arm, paths[:, a, b].T)) for b in range(3)] for a in range(2)]
    assert measure.of_paths(arm, paths, counts) == pytest.approx(np.array(one_by_one), rel=1e-12)
    assert measure.of_paths(arm, paths, None) == pytest.approx(measure.of_paths(arm, paths, np.ones(2)), rel=1e-12)
    once = np.ones(len(q))
    assert measure.gradient(arm, q, once) == pytest.approx(Measure.gradient(measure, arm, q, once), rel=1e-9)
    assert measure.curvature(arm, q, once) == pytest.approx(Measure.curvature(measure, arm, q, once), rel=1e-9)


@pytest.mark.parametrize(("measure", "robot"), EVERY, ids=lambda one: one.name)
def test_costs_keep_what_a_measure_promises(measure: Measure, robot: Robot) -> None:
    """Not negative, of the size of their scale; and what keeps the reduction does not mind yaw and turns of its own."""
    arm = arm_of(robot)
    q = postures(arm, 40)
    costs = measure.costs(arm, q)
    assert np.all(costs >= 0.0)
    assert 0.01 < float(np.median(costs)) / measure.scale(arm) < 100.0
    if measure.keeps_reduction and not isinstance(measure, JointAvailability):
        revolute = np.array([kind is JointKind.REVOLUTE for kind in arm.robot.joint_kinds])
        turned = q + TURN * revolute * np.random.default_rng(5).integers(-2, 3, q.shape)
        turned[:, 0] += 1.234
        assert measure.costs(arm, turned) == pytest.approx(costs, rel=1e-9)


def test_an_objective_adds_up() -> None:
    arm = arm_of("ur10e")
    q = postures(arm, 6)
    counts = np.array([1.0, 0.0, 2.0, 1.0, 0.5, 1.0])
    first, second = (Objective((replace(term, weight=1.0),)) for term in SUM.terms)
    asked: tuple[Callable[[Objective], Any], ...] = (
        lambda one: one.of_path(arm, q, counts),
        lambda one: one.of_paths(arm, q.T, counts),
        lambda one: one.of_poses(arm, q),
        lambda one: one.gradient(arm, q, counts),
        lambda one: one.curvature(arm, q, counts),
        lambda one: one.scale(arm),
    )
    for ask in asked:
        assert ask(SUM) == pytest.approx(0.5 * ask(first) + 20.0 * ask(second), rel=1e-12)
    assert SUM.of_path(arm, q, counts) == pytest.approx(float(SUM.of_paths(arm, q.T, counts)), rel=1e-12)


def test_only_joint_availability_alone_is_bounded() -> None:
    assert JOINT_AVAILABILITY.bounded
    assert (JOINT_AVAILABILITY.name, JOINT_AVAILABILITY.unit) == ("joint_availability", "rad²")
    assert not SUM.bounded
    assert (SUM.name, SUM.unit) == ("0.5 joint_availability + 20 manipulability", "1")


def test_nothing_asks_for_nothing() -> None:
    arm = arm_of("ur10e")
    q = postures(arm, 3)
    assert NOTHING.of_path(arm, q, np.ones(3)) == 0.0
    assert NOTHING.scale(arm) == 1.0


@pytest.mark.parametrize(
    ("terms", "pointer", "said"),
    [
        ([("manipulabilty", 1.0)], "/0/measure", "joint_availability, manipulability"),
        ([("manipulability", 1.0), ("manipulability", 2.0)], "/1/measure", "twice"),
        ([("manipulability", 0.0)], "/0/weight", "leave the measure out"),
        ([("manipulability", 1.0), ("joint_availability", -1.0)], "/1", "must be 0 or lie between"),
        ([], "", "at least one measure"),
    ],
)
def test_objectives_that_mean_nothing_are_refused(terms: list[tuple[str, float]], pointer: str, said: str) -> None:
    with pytest.raises(InvalidInput, match=said) as caught:
        objective_from(terms)
    assert caught.value.pointer == pointer
