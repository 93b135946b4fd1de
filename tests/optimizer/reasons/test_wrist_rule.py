"""A pose too near to the wrist's singularity is refused everywhere alike, unless the arm allows it."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import posture_of, signs_of
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.wrist_singularity import wrist_distance
from duocell.models.robot.arm import SINGULAR_WRIST, BaseRegion, Interval
from duocell.models.robot.posture import ALL_SIGNS, Posture
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.layers import best_path
from duocell.optimizer.reduction.reduced import evaluate, evaluate_signed, reduced_problem
from duocell.optimizer.results.layout import Outcome
from duocell.optimizer.settings import CertificateSettings
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.verification.verify import check
from tests.support.given.arms import form_of, make_arm
from tests.support.given.tasks import Possible, possible
from tests.support.present import present

POSE = 2


def through(name: str, distance: float, allow: bool = False) -> tuple[Possible, ArmSolution]:
    """A task whose witness is ``distance`` rad from the wrist's singularity at one pose."""
    task = possible(name, np.random.default_rng(3), half=(0.2, 0.2, 0.0, np.pi))
    form, joints = form_of(task.arm.robot), task.joints.copy()
    signs = posture_of(form, joints[0])
    zero = form.wrist_zero + np.pi * np.round((joints[:, 4].mean() - form.wrist_zero) / np.pi)
    side = np.sign(joints[0, 4] - zero)
    joints[:, 4] = zero + side * (distance + 0.02 * np.abs(np.arange(len(joints)) - POSE))
    arm = replace(task.arm, avoid_singularities=not allow, posture=Posture(*signs))
    flange = arm.base_in_world(task.position, task.yaw) @ flange_poses(arm.robot, joints)
    cell = Cell(Task(flange @ arm.tool @ inverse(arm.grasp)), (arm,), task.cell.max_joint_step)
    return Possible(cell, task.position, task.yaw, joints), ArmSolution(task.position, task.yaw, joints, signs)


def fixed(task: Possible) -> Cell:
    sides = (Interval(float(v), float(v)) for v in (*task.position, task.yaw))
    base = replace(task.arm.base, **dict(zip(("x", "y", "z", "yaw"), sides, strict=True)))
    return replace(task.cell, arms=(replace(task.arm, base=base),))


@pytest.mark.parametrize("name", ["puma560", "ur10e"])
@pytest.mark.parametrize(("distance", "usable"), [(3e-4, False), (2e-3, True)])
def test_verification_and_reduced_problem_agree(name: str, distance: float, usable: bool) -> None:
    for allow in (False, True):
        task, point = through(name, distance, allow)
        assert check(task.cell, task.arm, point).usable is (usable or allow)
        problem = present(reduced_problem(task.cell, task.arm))
        paths = evaluate_signed(problem, point.position[None], np.array([point.signs]))
        assert bool(paths.violation[0, 0] <= 1e-9) is (usable or allow)
        every = evaluate(problem, point.position[None])
        assert every.singular[ALL_SIGNS.index(point.signs), 0] == pytest.approx(paths.singular[0, 0])
        assert bool(best_path(task.cell, task.arm, point.position, task.yaw).violation <= 1e-9) is (usable or allow)


@pytest.mark.parametrize("given", [True, False], ids=["joints", "base"])
@pytest.mark.parametrize("name", ["puma560", "ur10e"])
def test_an_evaluation_names_the_pose_and_the_rule(name: str, given: bool) -> None:
    task, point = through(name, 3e-4)
    found = evaluate_layout(fixed(task), [point.joints] if given else None)
    assert found.outcome is Outcome.INFEASIBLE
    assert [(reason.kind, reason.poses) for reason in found.reasons] == [("singularity", (POSE,))]
    assert found.placements[0].avoids_singularities
    task, point = through(name, 3e-4, allow=True)
    found = evaluate_layout(fixed(task), [point.joints] if given else None)
    assert found.outcome is Outcome.FEASIBLE
    assert not found.placements[0].avoids_singularities


@pytest.mark.parametrize(("name", "distance"), [("puma560", 0.1), ("ur10e", 2e-3)])
def test_a_local_solve_that_is_drawn_to_the_singularity_stops_where_the_rule_says(name: str, distance: float) -> None:
    task, point = through(name, distance)
    form = form_of(task.arm.robot)
    zero = point.joints[0, 4] - np.sign(np.sin(point.joints[0, 4] - form.wrist_zero)) * wrist_distance(
        form.wrist_zero, point.joints[:1, 4]
    )
    reference = np.where(np.arange(6) == 4, zero, task.joints.mean(axis=0))
    arm = replace(task.arm, reference=reference, weights=np.where(np.arange(6) == 4, 1.0, 1e-5))
    first = Task(task.cell.task.poses[POSE : POSE + 1])
    start = replace(point, joints=point.joints[POSE : POSE + 1])
    solved = {}
    for allow in (False, True):
        one = replace(arm, avoid_singularities=not allow)
        solved[allow] = solve_locally(replace(task.cell, task=first, arms=(one,)), one, start, time.perf_counter() + 60)
        assert solved[allow].status.has_point
        assert check(replace(task.cell, task=first, arms=(one,)), one, solved[allow].points[0]).usable
    nearest = {a: np.min(wrist_distance(form.wrist_zero, found.points[0].joints[:, 4])) for a, found in solved.items()}
    assert nearest[False] == pytest.approx(SINGULAR_WRIST, abs=1e-6)
    assert nearest[True] < 0.9 * SINGULAR_WRIST


def test_boxes_that_the_rule_excludes_are_told_as_singular_and_not_as_limits() -> None:
    arm = make_arm("ur10e", grasp=np.eye(4))
    form = form_of(arm.robot)
    q = np.array([0.3, -1.2, 1.4, -0.5, form.wrist_zero, 0.2])
    place = Interval(0.0, 0.0)
    shoulder = Posture(shoulder=1 if signs_of(form, q)[0] > 0 else -1)
    arm = replace(arm, base=BaseRegion(place, place, place, Interval(0.0, 0.0)), posture=shoulder)
    problem = present(reduced_problem(Cell(Task(flange_poses(arm.robot, q)[0][None]), (arm,)), arm))
    proof = certify(problem, None, CertificateSettings(gap=1e-3, time_limit=60.0))
    assert proof.infeasible
    kinds = {(obstacle.kind, obstacle.joint) for obstacle in proof.causes}
    assert ("singularity", 4) in kinds
    assert ("joint_limit", 4) not in kinds
