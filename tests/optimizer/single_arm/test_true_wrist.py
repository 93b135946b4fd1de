"""The wrist of an arm that is not quite as drawn: kept from its own singularity wherever a path is judged."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import path_signs
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.nominal import nominal, posture_form, singular_fifth
from duocell.models.robot.arm import SINGULAR_WRIST
from duocell.models.robot.posture import Posture
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.nlp.program import ArmSolution, joint_bounds
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Outcome
from duocell.optimizer.settings import Settings
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.verify import SIDE, check
from tests.models.kinematics.test_nominal import calibrated
from tests.support.given.arms import make_arm, region
from tests.support.given.fields import ArmFields
from tests.support.present import present

TRUE = calibrated("puma560", 2e-3, 1e-4, 3)
FIFTH = singular_fifth(TRUE)
JOINTS = np.array([0.3, -0.9, 1.2, 0.4, 0.0, -0.2])


def at(*beside: float, **given: Unpack[ArmFields]) -> tuple[Cell, Floats]:
    """A task of the calibrated arm that keeps its base, its wrist so far beside its singularity; and its joints."""
    assert FIFTH is not None
    joints = np.tile(JOINTS, (len(beside), 1))
    joints[:, 4] = FIFTH + np.array(beside)
    joints[:, 0] += 0.1 * np.arange(len(beside))
    form = posture_form(TRUE)
    assert form is not None
    shoulder, elbow, _ = path_signs(form, joints)
    posture = Posture(shoulder=shoulder, elbow=elbow)  # with either sign of the wrist it is as near to its singularity
    arm = replace(make_arm(TRUE, base=region(0.0, 0.0, 0.0, 0.0), reference=joints[0], posture=posture), **given)
    return Cell(Task(flange_poses(TRUE, joints)), (arm,), np.pi), joints


def drawn_fifth() -> float:
    meant = nominal(TRUE)
    assert meant is not None
    found = singular_fifth(meant.robot)
    assert found is not None
    return found


@pytest.mark.parametrize("beside", [0.5, 0.98, -0.98])
def test_a_wrist_near_its_own_singularity_is_not_usable_unless_that_is_allowed(beside: float) -> None:
    cell, joints = at(beside * SINGULAR_WRIST, 0.2)
    assert check(cell, cell.arms[0], ArmSolution(np.zeros(3), 0.0, joints)).singularity > 0.0
    given = evaluate_layout(cell, [joints])
    assert given.outcome is Outcome.INFEASIBLE
    assert any(reason.kind == "singularity" for reason in given.reasons)
    assert not optimize(cell, Settings(time_limit=60.0)).usable
    allowed, _ = at(beside * SINGULAR_WRIST, 0.2, avoid_singularities=False)
    assert evaluate_layout(allowed, [joints]).outcome is Outcome.FEASIBLE


def test_a_wrist_at_the_singularity_of_its_drawing_alone_is_usable() -> None:
    assert FIFTH is not None
    beside = drawn_fifth() - FIFTH
    assert abs(beside) > 1.1 * SINGULAR_WRIST
    far = beside + 1e-4 * np.sign(beside)  # on one side of the drawing's posture
    cell, joints = at(far)
    found = check(cell, cell.arms[0], ArmSolution(np.zeros(3), 0.0, joints))
    assert found.usable
    layout = optimize(cell, Settings(time_limit=60.0))
    assert layout.usable
    assert layout.placements[0].singularity_distances["wrist"] == pytest.approx(abs(far), rel=1e-3)
    assert layout.certificate is not None
    assert layout.certificate.lower_bound is not None
    assert present(layout.certificate.lower_bound) <= present(layout.objective)


def test_a_way_through_the_singularity_of_the_wrist_is_told() -> None:
    cell, joints = at(-0.05, 0.05)
    checked = check_arm_path(cell, cell.arms[0], ArmSolution(np.zeros(3), 0.0, joints))
    assert checked.breaks
    allowed, _ = at(-0.05, 0.05, avoid_singularities=False)
    assert not check_arm_path(allowed, allowed.arms[0], ArmSolution(np.zeros(3), 0.0, joints)).breaks
    beside, joints = at(0.05, 0.1)
    assert not check_arm_path(beside, beside.arms[0], ArmSolution(np.zeros(3), 0.0, joints)).breaks


def test_programs_keep_the_wrist_on_its_side() -> None:
    assert FIFTH is not None
    for side in (-1.0, 1.0):
        cell, joints = at(side * 0.01, side * 0.02)
        low, high = joint_bounds(cell.arms[0], ArmSolution(np.zeros(3), 0.0, joints))
        nearer = high[4] if side < 0.0 else low[4]
        assert nearer == pytest.approx(FIFTH + side * SINGULAR_WRIST, abs=1e-12)


def test_programs_keep_the_elbow_of_the_drawing_on_its_side() -> None:
    form = posture_form(TRUE)
    assert form is not None
    straight = -form.turns[2] * form.planar.elbow_angle
    cell, joints = at(0.5, 0.5)
    low, high = joint_bounds(cell.arms[0], ArmSolution(np.zeros(3), 0.0, joints))
    off = np.remainder(np.array([low[2], high[2]]) - straight + 0.1, np.pi) - 0.1
    assert np.abs(off).min() < 1e-12
    assert low[2] < joints[0, 2] < high[2]


def test_the_posture_of_the_drawing_is_kept_along_the_path() -> None:
    form = posture_form(TRUE)
    assert form is not None
    straight = -form.turns[2] * form.planar.elbow_angle
    cell, joints = at(0.5, 0.5)
    joints[:, 2] = straight + np.array([-0.1, 0.1])
    cell = replace(cell, task=Task(flange_poses(TRUE, joints)))
    found = check(cell, cell.arms[0], ArmSolution(np.zeros(3), 0.0, joints))
    assert found.posture > SIDE
    assert not found.usable
