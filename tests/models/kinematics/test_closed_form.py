"""Which arms have a closed form, and the lengths and angles of its triangle against Pinocchio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.kinematics import flange_poses
from tests.support.angles import wrapped
from tests.support.given.arms import form_of, general_six, oblique_wrist, puma_by_table, random_joints, skew_robot
from tests.support.given.classes import CLOSED, OTHERS
from tests.support.oracles.signs import joint_axes

SPHERICAL = ("puma560", "kr6_r900", "irb120", "rx160", "lrmate200id", "gp8", "j2s6s300", "vs060", "rs007n")
PARALLEL = ("ur3e", "ur5e", "ur10e", "cr5", "nova5", "standardbots_core", "z1")


def test_classes_of_known_arms() -> None:
    assert {form_of(catalogue.robot(name)).kind for name in SPHERICAL} == {"spherical-wrist"}
    assert {form_of(catalogue.robot(name)).kind for name in PARALLEL} == {"three-parallel"}
    assert all(catalogue.robot(name).dof == 6 for name in CLOSED)
    assert {"fanuc_crx10ia", "xarm6", "hc10", "iiwa14", "gen3"} <= set(OTHERS)


def test_classes_of_arms_sent_as_tables() -> None:
    assert form_of(puma_by_table()).kind == "spherical-wrist"
    assert form_of(skew_robot()).kind == "spherical-wrist"
    assert form_of(oblique_wrist()).kind == "spherical-wrist"
    assert closed_form(general_six()) is None


@pytest.mark.parametrize("joint", [1, 2, 3, 4, 5])
def test_an_arm_bent_a_little_out_of_its_class_has_none(joint: int) -> None:
    """Any placement shifted and turned by a hair: its wrist axes no longer meet, or axes 2 and 3 are not parallel."""
    robot = catalogue.robot("puma560")
    placements = robot.joint_placements.copy()
    placements[joint] = placements[joint] @ transform(rotation_x(1e-3), [1e-4, 1e-4, 1e-4])
    bent = closed_form(replace(robot, joint_placements=placements))
    # axis 1 may lie anywhere against axis 2, and axis 4 against axis 3
    assert (bent is None) == (joint not in (1, 3))


@pytest.mark.parametrize("name", CLOSED)
def test_the_frame_of_the_triangle_is_orthonormal(name: str) -> None:
    form = form_of(catalogue.robot(name))
    frame = np.array([form.forward, form.n, form.up])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert form.offset >= -1e-9
    assert abs(form.forward @ form.axes[0]) < 1e-9


@pytest.mark.parametrize("name", CLOSED)
def test_the_triangle_is_that_of_the_joint_axes_in_every_posture(name: str) -> None:
    robot = catalogue.robot(name)
    form = form_of(robot)
    joints = random_joints(robot, 20, np.random.default_rng(0))
    axis, point = joint_axes(robot, joints)
    poses = flange_poses(robot, joints)
    wrist = poses[:, :3, 3] + poses[:, :3, :3] @ form.wrist_in_flange
    end = wrist if form.kind == "spherical-wrist" else point[3]

    def flat(vectors: Floats) -> Floats:
        within: Floats = vectors - axis[1] * np.sum(axis[1] * vectors, axis=1, keepdims=True)
        return within

    upper, fore = flat(point[2] - point[1]), flat(end - point[2])
    assert np.linalg.norm(upper, axis=1) == pytest.approx(np.full(20, form.planar.upper), abs=1e-7)
    assert np.linalg.norm(fore, axis=1) == pytest.approx(np.full(20, form.planar.fore), abs=1e-7)
    n = axis[1] * form.turns[1]
    sine, cosine = np.sum(n * np.cross(upper, fore), axis=1), np.sum(upper * fore, axis=1)
    bend = form.planar.elbow_angle + form.turns[2] * joints[:, 2]
    assert np.abs(wrapped(np.arctan2(sine, cosine) - bend)).max() < 1e-6
    hand = np.linalg.norm(flat(wrist - end), axis=1)
    assert hand == pytest.approx(np.full(20, np.hypot(*form.planar.hand)), abs=1e-7)
    for line in (4, 5):  # the wrist point is on axes 5 and 6
        off = np.cross(wrist - point[line], axis[line])
        assert np.linalg.norm(off, axis=1).max() < 1e-6


@pytest.mark.parametrize("name", CLOSED)
def test_the_wrist_is_singular_at_its_zero(name: str) -> None:
    """There axes 4 and 6 (or 2 and 6) and axis 5 lie in one plane."""
    robot = catalogue.robot(name)
    form = form_of(robot)
    joints = random_joints(robot, 5, np.random.default_rng(1))
    joints[:, 4] = form.wrist_zero
    axis, _ = joint_axes(robot, joints)
    other = axis[3] if form.kind == "spherical-wrist" else axis[1]
    assert np.abs(np.sum(axis[4] * np.cross(other, axis[5]), axis=1)).max() < 1e-6


def test_forms_are_kept() -> None:
    assert closed_form(catalogue.robot("ur5e")) is closed_form(catalogue.robot("ur5e"))
