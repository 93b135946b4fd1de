"""Layouts of arms that are not quite as drawn: found on the drawing, kept on the true arm."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Unpack

import numpy as np
import pinocchio as pin
import pytest

from duocell.models.base.pose import rotation_x, transform
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.reference import working_reference
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import line
from duocell.models.description.urdf import robot_from_urdf
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.nominal import as_drawn, nominal
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import Posture
from duocell.models.robot.robot import Robot
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import Settings
from duocell.service.library.library import Library
from duocell.service.library.user_robot import UserRobot
from duocell.service.requests.convert import cell_of
from duocell.service.requests.warnings import warnings_of
from duocell.service.schemas.request import LayoutRequest
from tests.models.kinematics.test_nominal import calibrated
from tests.support.given.acceptance import FOLDER
from tests.support.given.arms import make_arm, region
from tests.support.given.fields import ArmFields
from tests.support.present import present

ROBOT = robot_from_urdf(FOLDER / "urdf" / "16_calibrated_three_parallel_arm.urdf")
ENDS = [transform(rotation_x(np.pi), np.array([0.0, side, 0.3])) for side in (-0.2, 0.2)]


def solved(**given: Unpack[ArmFields]) -> tuple[Cell, Arm, Layout]:
    arm = make_arm(ROBOT, base=region((-1.0, 1.0), (-1.0, 1.0)), **given)
    cell = Cell(line(ENDS[0], ENDS[1], 8), (arm,))
    return cell, arm, optimize(cell, Settings(time_limit=120.0))


def test_a_calibrated_arm_is_laid_out_as_well_as_its_drawing_and_verified_as_it_is() -> None:
    meant = nominal(ROBOT)
    assert closed_form(ROBOT) is None
    assert meant is not None
    cell, arm, layout = solved()
    assert layout.outcome is Outcome.FEASIBLE  # the room for what the arm is off its drawing leaves a gap
    (placement,) = layout.placements
    reached = arm.base_in_world(placement.position, placement.yaw) @ flange_poses(ROBOT, placement.joints)
    assert np.abs(reached - cell.task.poses).max() < 1e-6
    drawn = make_arm(meant.robot, base=arm.base, reference=arm.reference)
    best = optimize(Cell(cell.task, (drawn,)), Settings(time_limit=120.0))
    assert best.outcome is Outcome.OPTIMAL
    assert layout.objective == pytest.approx(best.objective, rel=0.02)
    assert placement.posture == best.placements[0].posture
    assert layout.certificate is not None
    (proof,) = layout.certificate.arms
    assert proof.lower_bound is not None
    assert 0.7 * present(layout.objective) < present(proof.lower_bound) < present(layout.objective)
    assert best.certificate is not None
    # the drawing's own bound would be wrong here
    assert present(best.certificate.lower_bound) > present(layout.objective)
    assert layout.certificate.lower_bound == proof.lower_bound
    assert layout.certificate.gap == pytest.approx(1.0 - present(proof.lower_bound) / present(layout.objective))
    assert "no layout of this arm itself costs less" in proof.note
    assert f"{1000.0 * meant.position:.3g} mm" in proof.note


def test_a_posture_may_be_asked_for() -> None:
    _, _, layout = solved(posture=Posture(elbow=1))
    assert layout.usable
    assert layout.placements[0].posture is not None
    assert layout.placements[0].posture["elbow"] == "down"


@pytest.mark.parametrize("digits", ["1.570796325", "1.5707963267948966"])
def test_nine_digits_and_all_of_them_give_the_same_layout(digits: str, tmp_path: Path) -> None:
    text = (FOLDER / "urdf" / "17_puma_nine_digit_angles_called_infeasible.urdf").read_text(encoding="utf-8")
    file = tmp_path / "arm.urdf"
    file.write_text(re.sub(r'rpy="[^"]*"', lambda found: found[0].replace("1.570796325", digits), text))
    request = json.loads((FOLDER / "urdf" / "17_request.json").read_text(encoding="utf-8"))
    found = Library(tmp_path, given={"pu9": UserRobot(robot_from_urdf(file), None, "1")})
    asked = LayoutRequest.model_validate(request)
    cell = cell_of(asked, found)
    layout = optimize(cell, Settings(time_limit=120.0))
    assert layout.objective == pytest.approx(502.87258, abs=2e-5)
    assert layout.certificate is not None
    assert layout.certificate.lower_bound is not None  # a bound of its own, as near as the effort allows
    assert 0.99 * present(layout.objective) < present(layout.certificate.lower_bound) <= present(layout.objective)
    told = [warning.detail for warning in warnings_of(asked, cell, layout) if warning.pointer == "/arms/1/limits"]
    assert "a5 passes its limit by 0.60° between poses 8 and 9" in told[0]


def test_a_calibrated_arm_is_proved_optimal_where_the_difference_is_small_enough() -> None:
    arm = make_arm(calibrated("ur10e", 5e-6, 5e-6), base=region((-1.0, 1.0), (-1.0, 1.0)))
    layout = optimize(Cell(line(ENDS[0], ENDS[1], 8), (arm,)), Settings(time_limit=120.0))
    assert layout.outcome is Outcome.OPTIMAL


def test_a_task_that_neither_the_arm_nor_its_drawing_can_do_is_proved_infeasible() -> None:
    robot = calibrated("ur10e", 1e-3, 2e-4)
    limits = robot.lower.copy(), robot.upper.copy()
    limits[0][2], limits[1][2] = -1.0, 1.0  # the elbow is too straight for what is so near
    arm = make_arm(robot, base=region((-0.2, 0.2), (-0.2, 0.2)), lower=limits[0], upper=limits[1])
    layout = optimize(Cell(line(ENDS[0], ENDS[1], 8), (arm,)), Settings(time_limit=120.0))
    assert layout.outcome is Outcome.INFEASIBLE
    assert layout.certificate is not None
    assert layout.certificate.infeasible
    assert layout.search.starts == 0  # nothing else had to be tried
    assert layout.reasons


def urdf_of(robot: Robot) -> str:
    """A file with all digits of a robot's numbers."""
    parts, above = ['<robot name="made"><link name="base_link"/>'], "base_link"
    for i, (placement, axis) in enumerate(zip(robot.joint_placements, robot.joint_axes, strict=True)):
        low, high = float(robot.lower[i]), float(robot.upper[i])
        numbers = (placement[:3, 3], pin.rpy.matrixToRpy(placement[:3, :3]), axis)
        xyz, rpy, along = (" ".join(repr(float(value)) for value in row) for row in numbers)
        parts.append(
            f'<link name="l{i}"/><joint name="j{i}" type="revolute"><parent link="{above}"/><child link="l{i}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{along}"/>'
            f'<limit lower="{low!r}" upper="{high!r}" effort="1" velocity="1"/></joint>'
        )
        above = f"l{i}"
    return "".join([*parts, "</robot>"])


def test_digits_of_a_file_do_not_decide_between_mirrored_references(tmp_path: Path) -> None:
    """cr5 with the digits of its maker's file and with square axes: two mirror images score alike as a reference."""
    rounded = replace(catalogue.robot("cr5"), ssik_name=None, flanges=())
    robots, objectives = [], []
    for number, robot in enumerate((rounded, as_drawn(rounded))):
        file = tmp_path / f"{number}.urdf"
        file.write_text(urdf_of(robot))
        robots.append(robot_from_urdf(file))
        arm = make_arm(robots[-1], base=region((-1.0, 1.0), (-1.0, 1.0)))
        objectives.append(optimize(Cell(line(ENDS[0], ENDS[1], 8), (arm,)), Settings(time_limit=120.0)).objective)
    by_digits = working_reference(rounded)[0]
    assert np.abs(by_digits - robots[1].reference).max() > 1.0  # as it would be without the drawing
    assert robots[0].reference == pytest.approx(robots[1].reference, abs=1e-6)
    assert objectives[0] == pytest.approx(objectives[1], rel=1e-2)
